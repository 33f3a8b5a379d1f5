#include "vdi/gpu/ReducePass.h"

namespace vdi::gpu {

namespace {

ComputePipelineInfo pipelineInfo() {
  ComputePipelineInfo info;
  info.shader = "reduce";
  info.pushConstantBytes = sizeof(shared::ReduceConstants);
  return info;
}

}  // namespace

ReducePass::ReducePass(std::shared_ptr<Device> device) : pipelines_(std::move(device), pipelineInfo()) {}

void ReducePass::record(Commands& commands, const shared::ReduceConstants& constants) {
  commands.dispatch(pipelines_.with({0, 0, isCompact(constants.form)}), constants,
                    (constants.listCount + shared::reduceGroup - 1) / shared::reduceGroup);
}

}  // namespace vdi::gpu
