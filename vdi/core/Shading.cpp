#include "vdi/core/Shading.h"

#include <fmt/format.h>

#include <cmath>

#include "vdi/core/Error.h"
#include "vdi/core/Finite.h"

namespace vdi {

namespace {

/// Direction from angles in degrees, as vtkLightKit places its lights on a sphere around the focal point.
glm::dvec3 onSphere(double elevation, double azimuth) {
  const double up = glm::radians(elevation);
  const double right = glm::radians(azimuth);
  return {std::cos(up) * std::sin(right), std::sin(up), std::cos(up) * std::cos(right)};
}

}  // namespace

std::vector<Light> lightKit() {
  constexpr double key = 0.75;
  const glm::dvec3 neutral(0.9998);
  return {{onSphere(0.0, 0.0), key / 3.0 * neutral},
          {onSphere(50.0, 10.0), key * glm::dvec3(1.0, 0.97232, 0.90222)},
          {onSphere(-75.0, -10.0), key / 3.0 * glm::dvec3(0.90824, 0.93314, 1.0)},
          {onSphere(0.0, 110.0), key / 3.5 * neutral},
          {onSphere(0.0, -110.0), key / 3.5 * neutral}};
}

void validate(const Shading& shading) {
  if (!shading.on) return;
  const auto refuse = [](const std::string& what) { throw Error(ErrorCode::InvalidArgument, what); };
  if (shading.lights.size() > maxLights)
    refuse(fmt::format("at most {} lights can shine on a volume, but {} were given", maxLights,
                       shading.lights.size()));
  for (const Light& light : shading.lights) {
    if (!isFinite(light.direction)) refuse("a light's direction must be finite");
    const glm::dvec3& c = light.color;
    if (!isFinite(c) || !(c.x >= 0.0 && c.y >= 0.0 && c.z >= 0.0))
      refuse(fmt::format("a light's colour must be finite and not negative, but is {} {} {}", c.x, c.y, c.z));
  }
}

glm::dvec3 worldDirection(const Light& light, const View& view) {
  const glm::dvec3& d = light.direction;
  const glm::dvec3 world = d.x * view.right() + d.y * view.up() - d.z * view.forward();
  const double length = glm::length(world);
  return length > 0.0 ? world / length : glm::dvec3(0.0);
}

}  // namespace vdi
