#include "vdi/gpu/InterpolatePass.h"

namespace vdi::gpu {

namespace {

ComputePipelineInfo interpolateInfo() {
  ComputePipelineInfo info;
  info.shader = "interpolate";
  info.pushConstantBytes = sizeof(shared::InterpolateConstants);
  return info;
}

}  // namespace

InterpolatePass::InterpolatePass(std::shared_ptr<Device> device)
    : pipelines_(std::move(device), interpolateInfo()) {}

void InterpolatePass::record(Commands& commands, const shared::InterpolateConstants& constants) {
  commands.dispatch(pipelines_.with({constants.quotas != 0 ? 1U : 0U}), constants,
                    groupsFor(constants.width, shared::interpolateGroup), constants.rows);
}

}  // namespace vdi::gpu
