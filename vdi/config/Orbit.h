// Cameras around a scene.
#pragma once

#include <glm/glm.hpp>

#include "vdi/core/Box.h"
#include "vdi/core/Camera.h"

namespace vdi::config {

/// A position on an orbit. At azimuth 0, the camera looks along -z if up is y, and along +y if up is z.
struct Orbit {
  double azimuth = 0.0;          // degrees, about `up`
  double elevation = 0.0;        // degrees above the plane through the centre that is orthogonal to `up`
  glm::dvec3 up{0.0, 1.0, 0.0};  // not zero
  double zoom = 1.0;             // > 1 enlarges the picture; in perspective, the camera comes nearer
  bool operator==(const Orbit&) const = default;
};

/// The camera at a place of an orbit. It shows the whole of `bounds` if zoom is 1. Its view-up is the orbit's
/// up.
Camera orbitCamera(const Box& bounds, const Orbit& orbit, double viewAngle = 30.0);

}  // namespace vdi::config
