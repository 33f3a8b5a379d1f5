#include "vdi/gpu/QuotaPass.h"

namespace vdi::gpu {

namespace {

ComputePipelineInfo quotaInfo() {
  ComputePipelineInfo info;
  info.shader = "quota";
  info.pushConstantBytes = sizeof(shared::QuotaConstants);
  return info;
}

}  // namespace

QuotaPass::QuotaPass(std::shared_ptr<Device> device) : pipeline_(std::move(device), quotaInfo()) {}

void QuotaPass::record(Commands& commands, const shared::QuotaConstants& constants) const {
  commands.dispatch(pipeline_, constants, groupsFor(constants.width, shared::quotaGroup), constants.rows);
}

}  // namespace vdi::gpu
