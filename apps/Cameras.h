// Cameras from JSON files, and cameras that orbit.
#pragma once

#include <filesystem>

#include "vdi/core/Box.h"
#include "vdi/core/Camera.h"

namespace vdi::apps {

/// Reads the file that docs/raw-volumes.md describes. Throws Error: Io if it cannot be read, Format if it is
/// not a camera.
Camera readCamera(const std::filesystem::path& path);

/// A position on an orbit. At azimuth 0, the camera looks along -z if up is y, and along +y if up is z.
struct Orbit {
  double azimuth = 0.0;          // degrees, about `up`
  double elevation = 0.0;        // degrees above the plane through the centre that is orthogonal to `up`
  glm::dvec3 up{0.0, 1.0, 0.0};  // not zero
  double zoom = 1.0;             // > 1 shows things larger: in perspective, from a shorter distance
};
/// Shows the whole of `bounds` if zoom is 1. Its view-up is the orbit's up.
Camera orbitCamera(const Box& bounds, const Orbit& orbit, double viewAngle = 30.0);

/// The camera turned about the focal point by vtkCamera::Azimuth, then by vtkCamera::Elevation. The view-up
/// stays, unless it would become parallel to the view direction or turn the picture over: then it turns too.
Camera turned(const Camera& camera, double azimuthDegrees, double elevationDegrees);

}  // namespace vdi::apps
