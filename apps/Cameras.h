// Cameras from JSON files, and cameras that orbit.
#pragma once

#include <filesystem>

#include "vdi/core/Box.h"
#include "vdi/core/Camera.h"

namespace vdi::apps {

/// docs/raw-volumes.md describes the file. Throws Error: Io if it can't be read, Format for anything that
/// isn't a camera.
Camera readCamera(const std::filesystem::path& path);

/// Sees the whole of `bounds` from azimuth (about y, 0 looks along -z) and elevation, in degrees; up is y.
/// `zoom` > 1 shows things larger: from nearer in perspective.
Camera orbitCamera(const Box& bounds, double azimuthDegrees, double elevationDegrees, double zoom = 1.0,
                   double viewAngle = 30.0);

/// Turned about the focal point as vtkCamera::Azimuth, then vtkCamera::Elevation do. The view-up stays as it
/// is, unless that would make it parallel to the view direction or turn the picture over: then it turns too.
Camera turned(const Camera& camera, double azimuthDegrees, double elevationDegrees);

}  // namespace vdi::apps
