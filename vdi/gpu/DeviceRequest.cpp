#include "vdi/gpu/DeviceRequest.h"

#include "vdi/core/Environment.h"

namespace vdi::gpu {

DeviceRequest requestFromEnvironment(int localRank) {
  DeviceRequest request;
  request.localRank = localRank;
  request.selector = environmentText("VDI_DEVICE").value_or("");
  request.validation = environmentFlag("VDI_VALIDATION");
  request.cacheFolder = cacheFolder();
  return request;
}

}  // namespace vdi::gpu
