#include "vdi/core/Scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "vdi/core/Error.h"

namespace vdi {

Scene localScene(std::span<const Block> blocks) {
  Scene scene;
  for (const Block& block : blocks) {
    if (block.owned.empty()) continue;
    scene.bounds.include(block.owned);
    const double finest = std::min({block.spacing.x, block.spacing.y, block.spacing.z});
    scene.minSpacing = scene.minSpacing > 0.0 ? std::min(scene.minSpacing, finest) : finest;
  }
  return scene;
}

float snapToScene(const Scene& scene, double value, int axis) {
  const glm::dvec3 size = scene.bounds.size();
  const double quantum = std::max({size.x, size.y, size.z}) * 0x1p-20;
  if (!(quantum > 0.0)) return 0.0F;
  return static_cast<float>(std::round((value - scene.bounds.center()[axis]) / quantum) * quantum);
}

DepthLattice depthLattice(const Scene& scene, const View& view, double samplesPerVoxel) {
  if (!(samplesPerVoxel >= 1.0 / 64.0 && samplesPerVoxel <= 64.0)) {
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("samples per voxel must lie in [1/64, 64], but is {}", samplesPerVoxel));
  }
  DepthLattice lattice;
  if (scene.bounds.empty() || !(scene.minSpacing > 0.0)) return lattice;
  double nearest = std::numeric_limits<double>::infinity();
  double farthest = -nearest;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 point{(corner & 1) != 0 ? scene.bounds.hi.x : scene.bounds.lo.x,
                           (corner & 2) != 0 ? scene.bounds.hi.y : scene.bounds.lo.y,
                           (corner & 4) != 0 ? scene.bounds.hi.z : scene.bounds.lo.z};
    nearest = std::min(nearest, view.depthOf(point));
    farthest = std::max(farthest, view.depthOf(point));
  }
  // Never -0, whose bits shaders would take for a large number.
  lattice.first = nearest > 0.0 ? nearest : 0.0;
  lattice.step = scene.minSpacing / samplesPerVoxel;
  if (farthest <= lattice.first) return lattice;
  const double samples = std::ceil((farthest - lattice.first) / lattice.step);
  if (samples > 0x1p24) {
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("a ray would need {:.3g} samples: the scene is {:.3g} deep and one sample {:.3g}",
                            samples, farthest - lattice.first, lattice.step));
  }
  lattice.count = static_cast<std::uint32_t>(samples);
  return lattice;
}

bool floatsResolve(const DepthLattice& lattice) {
  constexpr double farthest = 0x1p21;  // in samples; floats resolve an eighth of a sample there
  return lattice.first <= farthest * lattice.step;
}

bool samplesAreSlabs(const Scene& scene, const View& view, const DepthLattice& lattice) {
  double longest = 0.0;  // component of any ray's direction, which is linear in the pixel's coordinates
  for (int corner = 0; corner < 4; ++corner) {
    const Ray ray =
        view.rayThrough((corner & 1) != 0 ? view.width() : 0.0, (corner & 2) != 0 ? view.height() : 0.0);
    const glm::dvec3 size = glm::abs(ray.direction);
    longest = std::max({longest, size.x, size.y, size.z});
  }
  return 0.5 * lattice.step * longest <= slabReach * scene.minSpacing;
}

double outermostReach(const Scene& scene, const DepthLattice& lattice) {
  return valueReach * scene.minSpacing / lattice.step;
}

}  // namespace vdi
