// Clipping of a ray by planes (vdi/core/Region.h). Twin of shaders/region.glsl.
#pragma once

#include <glm/glm.hpp>
#include <span>

#include "vdi/core/Region.h"

namespace vdi::reference {

/// A part of a ray, from one depth to another.
struct RayPart {
  float enter = 0.0F;
  float leave = 0.0F;
};

/// The part of `part` on the shown sides of the planes. `start` is the ray's point at depth 0, relative to
/// `center` in world space; `direction` is per unit of depth.
RayPart clipped(std::span<const ClipPlane> planes, const glm::dvec3& center, const glm::vec3& start,
                const glm::vec3& direction, RayPart part);

}  // namespace vdi::reference
