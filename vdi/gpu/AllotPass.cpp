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

AllotPass::AllotPass(std::shared_ptr<Device> device) : pipelines_(std::move(device), pipelineInfo()) {}

void AllotPass::record(Commands& commands, const shared::AllotConstants& constants) {
  commands.dispatch(pipelines_.with({constants.quotas != 0 ? 1U : 0U}), constants, groupsFor(constants.width, shared::allotGroup), constants.rows);
}

}  // namespace vdi::gpu
