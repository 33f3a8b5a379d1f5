#include "vdi/config/Orbit.h"

#include <cmath>
#include <numbers>

namespace vdi::config {

namespace {

double inRadians(double degrees) {
  return degrees * std::numbers::pi / 180.0;
}

}  // namespace

Camera orbitCamera(const Box& bounds, const Orbit& orbit, double viewAngle) {
  const glm::dvec3 up = glm::normalize(orbit.up);
  const glm::dvec3 aside = std::abs(up.x) < 0.99 ? glm::dvec3(1.0, 0.0, 0.0) : glm::dvec3(0.0, 0.0, 1.0);
  const glm::dvec3 right = glm::normalize(aside - glm::dot(aside, up) * up);
  const glm::dvec3 back = glm::cross(right, up);
  const double azimuth = inRadians(orbit.azimuth);
  const double elevation = inRadians(orbit.elevation);
  const glm::dvec3 around = std::cos(azimuth) * back + std::sin(azimuth) * right;
  const glm::dvec3 from = std::cos(elevation) * around + std::sin(elevation) * up;
  Camera camera = Camera::framing(bounds, -from, orbit.up, viewAngle);
  camera.position = camera.focalPoint + (camera.position - camera.focalPoint) / orbit.zoom;
  camera.parallelScale /= orbit.zoom;
  return camera;
}

}  // namespace vdi::config
