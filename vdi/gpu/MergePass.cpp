#include "vdi/gpu/MergePass.h"

namespace vdi::gpu {

namespace {

ComputePipelineInfo pipelineInfo() {
  ComputePipelineInfo info;
  info.shader = "merge";
  info.pushConstantBytes = sizeof(shared::MergeConstants);
  return info;
}

}  // namespace

MergePass::MergePass(std::shared_ptr<Device> device) : pipelines_(std::move(device), pipelineInfo()) {}

void MergePass::record(Commands& commands, const shared::MergeConstants& constants) {
  commands.dispatch(pipelines_.with({0, 0, isCompact(constants.form)}), constants,
                    groupsFor(constants.listCount, shared::compositeGroup));
}

}  // namespace vdi::gpu
