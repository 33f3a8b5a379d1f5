#include "vdi/gpu/InterleavePass.h"

namespace vdi::gpu {

namespace {

ComputePipelineInfo interleaveInfo() {
  ComputePipelineInfo info;
  info.shader = "interleave";
  info.pushConstantBytes = sizeof(shared::InterleaveConstants);
  return info;
}

}  // namespace

InterleavePass::InterleavePass(std::shared_ptr<Device> device)
    : pipelines_(std::move(device), interleaveInfo()) {}

void InterleavePass::record(Commands& commands, const shared::InterleaveConstants& constants) {
  commands.dispatch(pipelines_.with({0, 0, encodingOf(constants.form)}), constants,
                    groupsFor(constants.listCount, shared::compositeGroup));
}

}  // namespace vdi::gpu
