#include "vdi/gpu/CellsPass.h"

#include "shaders/shared/cast.h"
#include "vdi/gpu/VolumePages.h"

namespace vdi::gpu {

namespace {

ComputePipelineInfo cellsInfo() {
  ComputePipelineInfo info = infoOf<shared::CellsConstants>("cells");
  info.imageCount = shared::castMaxPages;
  return info;
}

}  // namespace

CellsPass::CellsPass(std::shared_ptr<Device> device)
    : sampler_(device), pipelines_(std::move(device), cellsInfo()) {}

void CellsPass::record(Commands& commands, const shared::CellsConstants& constants,
                       std::span<const SampledImage> pages, std::uint64_t pagesVersion) {
  ComputePipeline& pipeline = pipelines_.with({static_cast<std::uint32_t>(pages.size())});
  if (boundVersion_ != pagesVersion) {
    pipeline.bindImages(imagesOf(pages), sampler_);
    boundVersion_ = pagesVersion;
  }
  const bool byGroups = constants.mode == shared::cellsModeMeasure;  // one workgroup a cell
  commands.dispatchMany(pipeline, constants, constants.cellCount, byGroups ? 1 : shared::cellsGroup);
}

}  // namespace vdi::gpu
