#include "vdi/reference/Region.h"

#include <algorithm>

namespace vdi::reference {

RayPart clipped(std::span<const ClipPlane> planes, const glm::dvec3& center, const glm::vec3& start,
                const glm::vec3& direction, RayPart part) {
  for (const ClipPlane& plane : planes) {
    const glm::dvec3 unit = glm::normalize(plane.normal);
    const glm::vec3 normal(unit);
    const auto offset = static_cast<float>(glm::dot(unit, plane.origin - center));
    const float towards = glm::dot(normal, direction);
    const float apart = offset - glm::dot(normal, start);
    if (towards > 0.0F) part.enter = std::max(part.enter, apart / towards);
    if (towards < 0.0F) part.leave = std::min(part.leave, apart / towards);
    if (towards == 0.0F && apart > 0.0F) part.leave = -1.0F;
  }
  return part;
}

}  // namespace vdi::reference
