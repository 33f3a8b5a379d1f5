#include "vdi/core/Margin.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vdi {

namespace {

/// Number of lists from the picture's middle to the farthest edge of the scene's box, and one more; infinite
/// if the box reaches behind the eye.
glm::dvec2 reachOf(const Box& bounds, const View& picture) {
  glm::dvec2 farthest{0.0};
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 point = picture.toView({(corner & 1) != 0 ? bounds.hi.x : bounds.lo.x,
                                             (corner & 2) != 0 ? bounds.hi.y : bounds.lo.y,
                                             (corner & 4) != 0 ? bounds.hi.z : bounds.lo.z});
    if (!picture.parallel() && !(point.z > 0.0)) return glm::dvec2(std::numeric_limits<double>::infinity());
    farthest =
        glm::max(farthest, glm::abs(glm::dvec2(point.x, point.y)) / (picture.parallel() ? 1.0 : point.z));
  }
  const double pixelSize = 2.0 * picture.halfHeight() / picture.height();
  return glm::ceil(farthest / pixelSize) + 1.0;
}

}  // namespace

glm::ivec2 marginOf(const Scene& scene, const Camera& camera, const GenerateSettings& settings) {
  if (!(settings.margin > 0.0) || scene.bounds.empty()) return glm::ivec2(0);
  const View picture(camera, settings.width, settings.height);
  const glm::dvec2 size{settings.width, settings.height};
  const glm::dvec2 needed = glm::max(reachOf(scene.bounds, picture) - glm::floor(0.5 * size), 0.0);
  glm::ivec2 margin(glm::min(glm::ceil(std::min(settings.margin, maxMargin) * size), needed));
  const DepthLattice lattice = depthLattice(scene, picture, settings.samplesPerVoxel);
  if (!samplesAreSlabs(scene, picture, lattice)) return margin;
  const auto areSlabs = [&] {
    return samplesAreSlabs(scene, View::withMargin(camera, settings.width, settings.height, margin), lattice);
  };
  while (margin != glm::ivec2(0) && !areSlabs())
    margin -= glm::max(margin / 16, glm::min(margin, glm::ivec2(1)));
  return margin;
}

View viewWithMargin(const Scene& scene, const Camera& camera, const GenerateSettings& settings) {
  return View::withMargin(camera, settings.width, settings.height, marginOf(scene, camera, settings));
}

}  // namespace vdi
