#include "vdi/gpu/CastPass.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "vdi/core/Scene.h"
#include "vdi/gpu/Device.h"
#include "vdi/gpu/VolumeStore.h"

namespace vdi::gpu {

namespace {

ComputePipelineInfo castInfo() {
  ComputePipelineInfo info = infoOf<shared::CastConstants>("cast");
  info.imageCount = shared::castMaxPages;
  info.uniformBytes = sizeof(shared::CastParams);
  info.hasPlane = true;
  return info;
}

ComputePipelineInfo sharingPipelineInfo() {
  ComputePipelineInfo info = castInfo();
  info.wholeSubgroups = true;
  return info;
}

/// One lane for each tolerance; a power of 2.
constexpr std::uint32_t maxLanesPerRay = 8;
static_assert(shared::castGroupX % maxLanesPerRay == 0);

}  // namespace

shared::CastParams castGeometry(const Scene& scene, const View& view, const DepthLattice& lattice) {
  shared::CastParams params{};
  const Ray middle = view.rayThrough(0.5 * view.width(), 0.5 * view.height());
  const Ray right = view.rayThrough(0.5 * view.width() + 1.0, 0.5 * view.height());
  const Ray up = view.rayThrough(0.5 * view.width(), 0.5 * view.height() + 1.0);
  const auto start = [&](const Ray& ray) { return ray.origin + lattice.first * ray.direction; };
  params.startBase = start(middle) - scene.bounds.center();
  params.startRight = start(right) - start(middle);
  params.startUp = start(up) - start(middle);
  params.directionBase = middle.direction;
  params.directionRight = right.direction - middle.direction;
  params.directionUp = up.direction - middle.direction;
  params.step = static_cast<float>(lattice.step);
  params.first = static_cast<float>(lattice.first);
  params.sampleCount = lattice.count;
  params.slabs = samplesAreSlabs(scene, view, lattice) ? 1U : 0U;
  params.reach = static_cast<float>(outermostReach(scene, lattice));
  for (int axis = 0; axis < 3; ++axis) {
    params.sceneLo[axis] = snapToScene(scene, scene.bounds.lo[axis], axis);
    params.sceneHi[axis] = snapToScene(scene, scene.bounds.hi[axis], axis);
  }
  params.width = static_cast<std::uint32_t>(view.width());
  params.height = static_cast<std::uint32_t>(view.height());
  // A position is the sum of a start and of a depth times a direction, each rounded to 24 bits.
  const glm::dvec3 half = 0.5 * scene.bounds.size();
  const double reach =
      glm::length(glm::dvec3(params.startBase)) + lattice.count * lattice.step + glm::length(half) +
      static_cast<float>(std::max(view.width(), view.height())) * glm::length(params.startRight);
  params.coordinateError = static_cast<float>(reach * 0x1p-21);
  return params;
}

CastPass::CastPass(const std::shared_ptr<Device>& device)
    : samplesAhead_(device->runsGpuPrograms() ? 4 : 1),
      lanesPerRay_(device->runsGpuPrograms() ? std::clamp(device->limits().subgroupSize, 1U, maxLanesPerRay)
                                             : 1),
      sampler_(device),
      pipelines_(device, castInfo(), true),
      lanePipelines_(pipelines_, sharingPipelineInfo()) {}

ComputePipeline& CastPass::pipelineFor(const Program& program) {
  const std::size_t pageCount = volume_->pages().size();
  assert(pageCount >= 1 && pageCount <= shared::castMaxPages);
  PipelineSet& pipelines = program.lanesPerRay > 1 ? lanePipelines_ : pipelines_;
  ComputePipeline& pipeline = pipelines.with(
      {program.program, static_cast<std::uint32_t>(pageCount), program.encoding, program.samplesAhead,
       program.lanesPerRay, program.cutAtGaps ? 1U : 0U, program.byNeed ? 1U : 0U,
       volume_->mayBeInfinite() ? 1U : 0U, volume_->reachesBeyondTable() ? 1U : 0U, program.shaded ? 1U : 0U,
       program.blendMode, program.takesNearest ? 1U : 0U, program.hasPieces ? 1U : 0U, volume_->colors()});
  const Bound now{volume_->pagesVersion(), volume_->slabsVersion()};
  Bound& bound = bound_[&pipeline];
  if (bound != now) {
    pipeline.bindImages(imagesOf(volume_->pages()), sampler_);
    pipeline.bindPlane(volume_->slabs(), sampler_);
    bound = now;
  }
  return pipeline;
}

void CastPass::record(Commands& commands, const shared::CastParams& params, Work work, Algorithm algorithm,
                      const Band& band) {
  assert(volume_ != nullptr && band.firstRow < band.lastRow);
  const bool writes = work == Work::Write;
  const std::uint32_t program = work == Work::Volume                ? shared::castProgramVolume
                                : work == Work::Histogram           ? shared::castProgramHistogram
                                : work == Work::CountLevels         ? shared::castProgramCountLevels
                                : algorithm == Algorithm::Bisection ? shared::castProgramSearch
                                : writes                            ? shared::castProgramWritePreSegments
                                                                    : shared::castProgramCountPreSegments;
  // Only the search program stores supersegments.
  const std::uint32_t encoding = program == shared::castProgramSearch ? band.form.encoding : 0;
  const shared::CastConstants constants{writes ? shared::castModeWrite : shared::castModeSearch,
                                        band.firstRow, band.lastRow};
  const bool counts = program == shared::castProgramCountPreSegments ||
                      program == shared::castProgramHistogram || program == shared::castProgramCountLevels;
  const std::uint32_t stride = counts ? band.countedStride : 1;
  // The row after the band is counted too.
  const std::uint32_t rows = (band.lastRow - band.firstRow + stride - 1) / stride + (stride > 1 ? 1 : 0);
  const std::uint32_t lanes = stride > 1 ? lanesPerRay_ : 1;
  const std::uint32_t width = (band.width + stride - 1) / stride * lanes;
  pipelines_.update(commands, params);
  // Counted samples may not be adjacent, so none are requested ahead.
  const std::uint32_t ahead = stride > 1 ? 1 : samplesAhead_;
  commands.dispatch(
      pipelineFor({program, encoding, lanes, ahead, band.cutAtGaps, params.level >= 0.0F, params.shaded != 0,
                   params.blendMode, params.takesNearest != 0, params.pieceCount > 0}),
      constants, groupsFor(width, shared::castGroupX), groupsFor(rows, shared::castGroupY));
}

}  // namespace vdi::gpu
