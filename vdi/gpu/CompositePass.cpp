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

CompositePass::CompositePass(std::shared_ptr<Device> device)
    : pipelines_(std::move(device), pipelineInfo()) {}

void CompositePass::record(Commands& commands, VkDeviceAddress params, const shared::StoredForm& form,
                           Work work, Algorithm algorithm, std::uint32_t listCount) {
  const bool write = work == Work::Write || work == Work::WriteByNeed;
  const std::uint32_t program = work == Work::Survey                ? shared::compositeProgramSurvey
                                : work == Work::WriteByNeed         ? shared::compositeProgramWriteByNeed
                                : algorithm == Algorithm::Bisection ? shared::compositeProgramSearch
                                : write                             ? shared::compositeProgramWriteGrains
                                                                    : shared::compositeProgramCountGrains;
  const std::uint32_t mode = write ? shared::compositeModeWrite : shared::compositeModeSearch;
  commands.dispatch(pipelines_.with({program, 0, isCompact(form)}),
                    shared::CompositeConstants{params, mode, 0},
                    (listCount + shared::compositeGroup - 1) / shared::compositeGroup);
}

}  // namespace vdi::gpu
