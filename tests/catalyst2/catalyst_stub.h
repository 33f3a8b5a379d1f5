/* What an implementation calls for the answer that all of them give. */
#ifndef VDI_TESTS_CATALYST2_STUB_H
#define VDI_TESTS_CATALYST2_STUB_H

#include "catalyst.h"

static inline enum catalyst_status catalyst_stub_about(conduit_node* params) {
  conduit_node_set_path_char8_str(params, "catalyst/version", "2.0.0");
  return catalyst_status_ok;
}

#endif
