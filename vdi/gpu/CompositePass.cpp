#include "vdi/gpu/CompositePass.h"

namespace vdi::gpu {

namespace {

ComputePipelineInfo pipelineInfo(std::uint32_t program) {
  ComputePipelineInfo info;
  info.shader = "composite";
  info.pushConstantBytes = sizeof(shared::CompositeConstants);
  info.specialization = {program};
  return info;
}

}  // namespace

CompositePass::CompositePass(const std::shared_ptr<Device>& device)
    : search_(device, pipelineInfo(shared::compositeProgramSearch)),
      countGrains_(device, pipelineInfo(shared::compositeProgramCountGrains)),
      writeGrains_(device, pipelineInfo(shared::compositeProgramWriteGrains)) {}

void CompositePass::record(Commands& commands, VkDeviceAddress params, Algorithm algorithm, bool write,
                           std::uint32_t listCount) const {
  const ComputePipeline& pipeline = algorithm == Algorithm::Bisection ? search_
                                    : write                           ? writeGrains_
                                                                      : countGrains_;
  const std::uint32_t mode = write ? shared::compositeModeWrite : shared::compositeModeSearch;
  commands.dispatch(pipeline, shared::CompositeConstants{params, mode, 0},
                    (listCount + shared::compositeGroup - 1) / shared::compositeGroup);
}

}  // namespace vdi::gpu
