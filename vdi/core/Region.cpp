#include "vdi/core/Region.h"

#include <fmt/format.h>

#include <cmath>

#include "vdi/core/Error.h"
#include "vdi/core/Finite.h"

namespace vdi {

void validate(const Region& region) {
  const auto refuse = [](const std::string& what) { throw Error(ErrorCode::InvalidArgument, what); };
  if (region.box && (!isFinite(region.box->lo) || !isFinite(region.box->hi) || region.box->empty()))
    refuse("the cropping box must be finite and have a positive size along each axis");
  if (region.planes.size() > maxClipPlanes)
    refuse(fmt::format("at most {} planes can clip a volume, but {} were given", maxClipPlanes,
                       region.planes.size()));
  for (const ClipPlane& plane : region.planes) {
    const double length = glm::length(plane.normal);
    if (!isFinite(plane.origin) || !std::isfinite(length) || !(length > 0.0))
      refuse("a clipping plane must be finite and have a normal");
  }
}

Box boundsIn(const Region& region, const Box& scene) {
  return region.box ? scene.intersection(*region.box) : scene;
}

}  // namespace vdi
