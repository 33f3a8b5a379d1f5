#include "vdi/gpu/AllotPass.h"

namespace vdi::gpu {

namespace {

ComputePipelineInfo pipelineInfo() {
  ComputePipelineInfo info;
  info.shader = "allot";
  info.pushConstantBytes = sizeof(shared::AllotConstants);
  return info;
}

}  // namespace

AllotPass::AllotPass(std::shared_ptr<Device> device) : pipeline_(std::move(device), pipelineInfo()) {}

void AllotPass::record(Commands& commands, const shared::AllotConstants& constants) const {
  commands.dispatch(pipeline_, constants, groupsFor(constants.width, shared::allotGroup), constants.rows);
}

}  // namespace vdi::gpu
