#include "vdi/gpu/CellsPass.h"

#include <algorithm>
#include <array>

#include "shaders/shared/cast.h"

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
    std::array<const SampledImage*, shared::castMaxPages> images{};
    for (std::size_t i = 0; i < images.size(); ++i) images[i] = &pages[std::min(i, pages.size() - 1)];
    pipeline.bindImages(images, sampler_);
    boundVersion_ = pagesVersion;
  }
  const bool byGroups = constants.mode == shared::cellsModeMeasure;  // one workgroup a cell
  commands.dispatchMany(pipeline, constants, constants.cellCount, byGroups ? 1 : shared::cellsGroup);
}

}  // namespace vdi::gpu
