#include "vdi/gpu/CompositePass.h"

namespace vdi::gpu {

namespace {

ComputePipelineInfo pipelineInfo() {
  ComputePipelineInfo info;
  info.shader = "composite";
  info.pushConstantBytes = sizeof(shared::CompositeConstants);
  return info;
}

}  // namespace

CompositePass::CompositePass(std::shared_ptr<Device> device) : pipeline_(std::move(device), pipelineInfo()) {}

void CompositePass::record(Commands& commands, VkDeviceAddress params, std::uint32_t mode,
                           std::uint32_t listCount) const {
  commands.dispatch(pipeline_, shared::CompositeConstants{params, mode, 0},
                    (listCount + shared::compositeGroup - 1) / shared::compositeGroup);
}

}  // namespace vdi::gpu
