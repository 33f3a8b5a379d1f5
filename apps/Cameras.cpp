#include "apps/Cameras.h"

#include <cmath>
#include <numbers>

#include "apps/JsonFile.h"
#include "vdi/core/Error.h"

namespace vdi::apps {

namespace {

double radians(double degrees) {
  return degrees * std::numbers::pi / 180.0;
}

}  // namespace

Camera readCamera(const std::filesystem::path& path) {
  const JsonFile file(path, {"position", "focal_point", "view_up", "view_angle", "parallel_scale"});
  Camera camera;
  camera.position = file.vector("position");
  camera.focalPoint = file.vector("focal_point");
  if (file.has("view_up")) camera.viewUp = file.vector("view_up");
  if (file.has("view_angle")) camera.viewAngle = file.number("view_angle");
  if (file.has("parallel_scale")) {
    if (file.has("view_angle")) file.fail("either 'view_angle' or 'parallel_scale'");
    camera.parallelProjection = true;
    camera.parallelScale = file.number("parallel_scale");
  }
  try {
    (void)View(camera, 1, 1);  // validates the camera
  } catch (const Error& error) {
    file.fail(error.what());
  }
  return camera;
}

Camera turned(const Camera& camera, double azimuthDegrees, double elevationDegrees) {
  Camera result = camera.azimuth(azimuthDegrees);
  if (elevationDegrees == 0.0) return result;
  const View view(result, 1, 1);
  const double angle = radians(elevationDegrees);
  const double distance = glm::length(result.position - result.focalPoint);
  const glm::dvec3 back = -view.forward() * std::cos(angle) + view.up() * std::sin(angle);
  result.position = result.focalPoint + back * distance;
  const glm::dvec3 up = view.up() * std::cos(angle) + view.forward() * std::sin(angle);
  // The sine of the angle between view-up and view direction, negative if the picture would flip.
  if (glm::dot(glm::normalize(result.viewUp), up) < 1e-3) result.viewUp = up;
  return result;
}

}  // namespace vdi::apps
