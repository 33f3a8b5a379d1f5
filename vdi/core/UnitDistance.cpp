#include "vdi/core/UnitDistance.h"

#include <cmath>
#include <glm/geometric.hpp>

namespace vdi {

double unitDistanceOf(const Box& bounds, double voxelVolume) {
  const glm::dvec3 size = bounds.empty() ? glm::dvec3(0.0) : bounds.size();
  const double volume = size.x * size.y * size.z;
  return volume > 0.0 ? glm::length(size) * std::cbrt(voxelVolume / volume) : 1.0;
}

}  // namespace vdi
