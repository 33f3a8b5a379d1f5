// Reads cameras from JSON files, and turns cameras.
#pragma once

#include <filesystem>

#include "vdi/core/Camera.h"

namespace vdi::apps {

/// Reads the file that docs/raw-volumes.md describes. Throws Error: Io if it can't be read, Format
/// if it isn't a camera.
Camera readCamera(const std::filesystem::path& path);

/// The camera turned about the focal point by vtkCamera::Azimuth, then by vtkCamera::Elevation. The
/// view-up stays, unless it would become parallel to the view direction or flip the picture. Then
/// it turns, too.
Camera turned(const Camera& camera, double azimuthDegrees, double elevationDegrees);

}  // namespace vdi::apps
