#include "vdi/reference/Blending.h"

#include <cmath>

namespace vdi::reference {

void Projection::add(double position, float depth) {
  if (std::isnan(position)) return;
  const bool isExtreme = !extreme_ || (mode_ == BlendMode::Maximum ? position > extreme_->position
                                                                   : position < extreme_->position);
  if (isExtreme) extreme_ = Extreme{position, depth};
}

glm::vec4 crossed(std::span<const Isosurface> surfaces, double front, double back,
                  const std::function<glm::vec3(double share)>& lightAt) {
  glm::vec4 sum(0.0F);
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const Isosurface& surface = front < back ? surfaces[i] : surfaces[surfaces.size() - 1 - i];
    const double at = surface.position;
    if (!((front < at && back >= at) || (front >= at && back < at))) continue;
    glm::vec4 material = surface.material;
    material *= glm::vec4(lightAt((at - front) / (back - front)), 1.0F);
    sum += (1.0F - sum.a) * material;
  }
  return sum;
}

}  // namespace vdi::reference
