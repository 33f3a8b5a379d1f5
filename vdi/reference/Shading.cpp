#include "vdi/reference/Shading.h"

#include <algorithm>
#include <cmath>

#include "vdi/reference/Interpolation.h"

namespace vdi::reference {

namespace {

/// The difference; zero if it counts as rounding, or if a value is not finite.
double differenceOf(double ahead, double behind) {
  const double difference = ahead - behind;
  const double least = leastGradient * (std::abs(ahead) + std::abs(behind));
  return std::isfinite(difference) && std::abs(difference) > least ? difference : 0.0;
}

}  // namespace

glm::dvec3 normalAt(const Block& block, const glm::dvec3& world, Interpolation interpolation) {
  glm::dvec3 gradient(0.0);
  for (int axis = 0; axis < 3; ++axis) {
    glm::dvec3 voxel(0.0);
    voxel[axis] = block.spacing[axis];
    gradient[axis] = differenceOf(interpolate(block, world + voxel, interpolation),
                                  interpolate(block, world - voxel, interpolation)) /
                     block.spacing[axis];
  }
  const double largest = std::max({std::abs(gradient.x), std::abs(gradient.y), std::abs(gradient.z)});
  return largest > 0.0 ? glm::normalize(gradient / largest) : glm::dvec3(0.0);
}

glm::vec3 lightAt(const GenerateSettings& settings, const View& view, const Block& block,
                  const glm::dvec3& world, const glm::dvec3& rayDirection) {
  const Shading& shading = settings.shading;
  const glm::dvec3 normal = normalAt(block, world, settings.interpolation);
  glm::dvec3 light(shading.ambient);
  for (const Light& one : shading.lights) {
    glm::dvec3 direction = worldDirection(one, view);
    if (direction == glm::dvec3(0.0)) direction = -glm::normalize(rayDirection);
    light += shading.diffuse * one.color * std::abs(glm::dot(normal, direction));
  }
  return light;
}

}  // namespace vdi::reference
