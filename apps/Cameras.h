// Cameras from JSON files, and cameras that orbit.
#pragma once

#include <filesystem>

#include "vdi/core/Box.h"
#include "vdi/core/Camera.h"

namespace vdi::apps {

/// docs/raw-volumes.md describes the file. Throws Error: Io if it can't be read, Format for anything that
/// isn't a camera.
Camera readCamera(const std::filesystem::path& path);

/// Where a camera orbits. At azimuth 0 it looks along -z where up is y, along +y where up is z.
struct Orbit {
  double azimuth = 0.0;          // degrees, about `up`
  double elevation = 0.0;        // degrees above the plane through the centre that `up` is orthogonal to
  glm::dvec3 up{0.0, 1.0, 0.0};  // not zero
  double zoom = 1.0;             // > 1 shows things larger: from nearer in perspective
};
/// Sees the whole of `bounds` if zoom is 1. Its view-up is the orbit's up.
Camera orbitCamera(const Box& bounds, const Orbit& orbit, double viewAngle = 30.0);

/// Turned about the focal point as vtkCamera::Azimuth, then vtkCamera::Elevation do. The view-up stays as it
/// is, unless that would make it parallel to the view direction or turn the picture over: then it turns too.
Camera turned(const Camera& camera, double azimuthDegrees, double elevationDegrees);

}  // namespace vdi::apps
