// Shading: how strongly lights illuminate a volume's samples. It is baked into the colours of a VDI, so a VDI
// keeps the light of its V_O when it is turned.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <vector>

#include "vdi/core/Camera.h"

namespace vdi {

/// A light that is infinitely far away, or at the eye. It moves with the camera.
struct Light {
  /// Direction towards the light, in the camera's axes: right, up, and from the scene to the camera. Its
  /// length does not matter. Zero: the light is at the eye and shines along each ray.
  glm::dvec3 direction{0.0};
  glm::dvec3 color{1.0};  // red, green, blue; times intensity; >= 0
  bool operator==(const Light&) const = default;
};

inline constexpr std::size_t maxLights = 8;

/// The five lights of ParaView's light kit, with a new view's settings.
std::vector<Light> lightKit();

/// Shading as VTK's volume mapper does it with two-sided lighting: the colour of a sample is multiplied by
///
///     ambient + diffuse * (sum over lights of color * |normal . direction|).
///
/// The normal is the direction of the scalar's gradient at the sample's middle, by central differences over
/// one voxel of the block on each side. Where there is no gradient, only ambient light remains. Opacity
/// stays as it is. There are no specular highlights: they belong to one viewpoint.
struct Shading {
  bool on = false;
  double ambient = 0.0;                    // [0, 1]
  double diffuse = 1.0;                    // [0, 1]
  std::vector<Light> lights = lightKit();  // at most maxLights
  bool operator==(const Shading&) const = default;
};

/// A difference smaller than this share of two values counts as rounding error.
inline constexpr double leastGradient = 1e-6;

/// If shading is on, throws Error{InvalidArgument} for lights that are not valid. Checks nothing else.
void validate(const Shading& shading);

/// Unit vector in world space; zero for a light at the eye.
glm::dvec3 worldDirection(const Light& light, const View& view);

}  // namespace vdi
