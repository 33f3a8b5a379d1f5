/* The functions of the implementation vdi, as the real API's CMake function declares them. */
#ifndef VDI_TESTS_CATALYST2_IMPL_H
#define VDI_TESTS_CATALYST2_IMPL_H

#include "catalyst.h"

#ifdef __cplusplus
extern "C" {
#endif

CATALYST_API enum catalyst_status catalyst_initialize_vdi(const conduit_node* params);
CATALYST_API enum catalyst_status catalyst_execute_vdi(const conduit_node* params);
CATALYST_API enum catalyst_status catalyst_finalize_vdi(const conduit_node* params);
CATALYST_API enum catalyst_status catalyst_about_vdi(conduit_node* params);
CATALYST_API enum catalyst_status catalyst_results_vdi(conduit_node* params);

#ifdef __cplusplus
}
#endif

#endif
