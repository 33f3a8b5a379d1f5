// Clipping of a ray by planes (vdi/core/Region.h). Twin of shaders/region.glsl.
#pragma once

#include <glm/glm.hpp>
#include <span>

#include "vdi/core/Region.h"

namespace vdi::reference {

/// Of a ray, from one depth to another.
struct RayPart {
  float enter = 0.0F;
  float leave = 0.0F;
};

/// The part on the sides of the planes that are shown. `start` and `direction`: as depths are counted from,
/// relative to `center`, world.
RayPart clipped(std::span<const ClipPlane> planes, const glm::dvec3& center, const glm::vec3& start,
                const glm::vec3& direction, RayPart part);

}  // namespace vdi::reference
