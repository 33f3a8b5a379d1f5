#include "vdi/gpu/CompositePass.h"

namespace vdi::gpu {

namespace {

ComputePipelineInfo compositeInfo() {
  ComputePipelineInfo info = infoOf<shared::CompositeConstants>("composite");
  info.uniformBytes = sizeof(shared::CompositeParams);
  return info;
}

}  // namespace

CompositePass::CompositePass(std::shared_ptr<Device> device)
    : pipelines_(std::move(device), compositeInfo(), true) {}

void CompositePass::record(Commands& commands, const shared::CompositeParams& params, Work work,
                           Algorithm algorithm) {
  const bool write = work == Work::Write;
  const std::uint32_t program = work == Work::Histogram             ? shared::compositeProgramHistogram
                                : algorithm == Algorithm::Bisection ? shared::compositeProgramSearch
                                : write                             ? shared::compositeProgramWritePreSegments
                                        : shared::compositeProgramCountPreSegments;
  const std::uint32_t mode = write ? shared::compositeModeWrite : shared::compositeModeSearch;
  pipelines_.update(commands, params);
  commands.dispatch(pipelines_.with({program, params.level >= 0.0F ? 1U : 0U, params.form.encoding}),
                    shared::CompositeConstants{mode}, groupsFor(params.listCount, shared::compositeGroup));
}

}  // namespace vdi::gpu
