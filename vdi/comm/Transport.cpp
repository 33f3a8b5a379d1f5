#include "vdi/comm/Transport.h"

#include "vdi/core/Environment.h"

namespace vdi::comm {

Transport transportFromText(std::string_view value) {
  if (value.empty() || value == "shared") return Transport::Shared;
  if (value == "mpi") return Transport::Mpi;
  refuseEnvironment("VDI_TRANSPORT", value);
}

}  // namespace vdi::comm
