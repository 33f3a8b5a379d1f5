// Cameras from JSON files, and turned ones.
#pragma once

#include <filesystem>

#include "vdi/core/Camera.h"

namespace vdi::apps {

/// Reads the file that docs/raw-volumes.md describes. Throws Error: Io if it cannot be read, Format if it is
/// not a camera.
Camera readCamera(const std::filesystem::path& path);

/// The camera turned about the focal point by vtkCamera::Azimuth, then by vtkCamera::Elevation. The view-up
/// stays, unless it would become parallel to the view direction or turn the picture over: then it turns too.
Camera turned(const Camera& camera, double azimuthDegrees, double elevationDegrees);

}  // namespace vdi::apps
