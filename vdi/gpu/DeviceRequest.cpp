#include "vdi/gpu/DeviceRequest.h"

#include <cstdlib>
#include <cstring>

namespace vdi::gpu {

DeviceRequest requestFromEnvironment(int localRank) {
  DeviceRequest request;
  request.localRank = localRank;
  if (const char* selector = std::getenv("VDI_DEVICE")) request.selector = selector;
  const char* validation = std::getenv("VDI_VALIDATION");
  request.validation = validation != nullptr && std::strcmp(validation, "1") == 0;
  return request;
}

}  // namespace vdi::gpu
