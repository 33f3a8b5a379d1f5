#include "vdi/gpu/CountsPass.h"

namespace vdi::gpu {

namespace {

ComputePipelineInfo countsInfo() {
  ComputePipelineInfo info;
  info.shader = "counts";
  info.pushConstantBytes = sizeof(shared::CountsConstants);
  return info;
}

}  // namespace

CountsPass::CountsPass(std::shared_ptr<Device> device) : pipeline_(std::move(device), countsInfo()) {}

void CountsPass::record(Commands& commands, const shared::CountsConstants& constants) const {
  if (constants.words > 0) commands.dispatchMany(pipeline_, constants, constants.words, shared::countsGroup);
}

}  // namespace vdi::gpu
