#include "vdi/gpu/CastPass.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "vdi/core/Scene.h"
#include "vdi/gpu/VolumeStore.h"

namespace vdi::gpu {

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
  for (int axis = 0; axis < 3; ++axis) {
    params.sceneLo[axis] = snapToScene(scene, scene.bounds.lo[axis], axis);
    params.sceneHi[axis] = snapToScene(scene, scene.bounds.hi[axis], axis);
  }
  params.width = static_cast<std::uint32_t>(view.width());
  params.height = static_cast<std::uint32_t>(view.height());
  // A position is the sum of a start and a depth times a direction, each rounded to 24 bits.
  const glm::dvec3 half = 0.5 * scene.bounds.size();
  const double reach = glm::length(glm::dvec3(params.startBase)) + lattice.count * lattice.step +
                       glm::length(half) +
                       std::max(view.width(), view.height()) * glm::length(params.startRight);
  params.coordinateError = static_cast<float>(reach * 0x1p-21);
  return params;
}

CastPass::CastPass(std::shared_ptr<Device> device) : device_(std::move(device)), sampler_(device_) {}

void CastPass::bind(const VolumeStore& volume) {
  const std::size_t pageCount = volume.pages().size();
  assert(pageCount >= 1 && pageCount <= shared::castMaxPages);
  if (bound_ != nullptr && boundVersion_ == volume.pagesVersion()) return;
  Pipelines& pipelines = pipelines_[pageCount];
  std::array<const Image3D*, shared::castMaxPages> images{};
  for (std::size_t i = 0; i < images.size(); ++i) images[i] = &volume.pages()[std::min(i, pageCount - 1)];
  for (std::uint32_t program = 0; program < pipelines.size(); ++program) {
    std::unique_ptr<ComputePipeline>& pipeline = pipelines[program];
    if (!pipeline) {
      ComputePipelineInfo info;
      info.shader = "cast";
      info.pushConstantBytes = sizeof(shared::CastConstants);
      info.imageCount = shared::castMaxPages;
      info.specialization = {program, static_cast<std::uint32_t>(pageCount)};
      pipeline = std::make_unique<ComputePipeline>(device_, info);
    }
    pipeline->bindImages(images, sampler_);
  }
  bound_ = &pipelines;
  boundVersion_ = volume.pagesVersion();
}

void CastPass::record(Commands& commands, VkDeviceAddress params, Work work, Algorithm algorithm,
                      std::uint32_t width, std::uint32_t firstRow, std::uint32_t lastRow) const {
  assert(bound_ != nullptr && firstRow < lastRow);
  const bool writes = work == Work::Write;
  const std::uint32_t program = work == Work::Volume                ? shared::castProgramVolume
                                : algorithm == Algorithm::Bisection ? shared::castProgramSearch
                                : writes                            ? shared::castProgramWriteGrains
                                                                    : shared::castProgramCountGrains;
  const shared::CastConstants constants{params, writes ? shared::castModeWrite : shared::castModeSearch,
                                        firstRow, lastRow, 0};
  commands.dispatch(*(*bound_)[program], constants, (width + shared::castGroupX - 1) / shared::castGroupX,
                    (lastRow - firstRow + shared::castGroupY - 1) / shared::castGroupY);
}

}  // namespace vdi::gpu
