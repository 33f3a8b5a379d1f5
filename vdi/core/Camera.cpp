#include "vdi/core/Camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "vdi/core/Error.h"
#include "vdi/core/Finite.h"

namespace vdi {

namespace {

double radians(double degrees) {
  return degrees * std::numbers::pi / 180.0;
}

/// View-up scaled to length 1, without overflow; the y axis if it is zero, as in vtkCamera::SetViewUp.
glm::dvec3 unitUp(const glm::dvec3& up) {
  const glm::dvec3 magnitude = glm::abs(up);
  const double largest = std::max({magnitude.x, magnitude.y, magnitude.z});
  return largest > 0.0 ? glm::normalize(up / largest) : glm::dvec3(0.0, 1.0, 0.0);
}

/// The up direction made orthogonal to `forward`; any orthogonal direction if `up` does not determine one.
glm::dvec3 orthogonalUp(const glm::dvec3& up, const glm::dvec3& forward) {
  const glm::dvec3 unit = unitUp(up);
  const glm::dvec3 rest = unit - glm::dot(unit, forward) * forward;
  if (glm::length(rest) > 1e-9) return glm::normalize(rest);
  const glm::dvec3 magnitude = glm::abs(forward);
  glm::dvec3 axis{0.0, 0.0, 1.0};
  if (magnitude.x <= magnitude.y && magnitude.x <= magnitude.z) {
    axis = {1.0, 0.0, 0.0};
  } else if (magnitude.y <= magnitude.z) {
    axis = {0.0, 1.0, 0.0};
  }
  return glm::normalize(axis - glm::dot(axis, forward) * forward);
}

void validateCamera(const Camera& camera) {
  if (!isFinite(camera.position) || !isFinite(camera.focalPoint) || !isFinite(camera.viewUp)) {
    throw Error(ErrorCode::InvalidArgument, "the camera's position, focal point and view-up must be finite");
  }
  const double distance = glm::length(camera.focalPoint - camera.position);
  if (!(distance > 0.0) || !std::isfinite(distance)) {
    throw Error(ErrorCode::InvalidArgument, "the camera's position equals its focal point");
  }
  if (camera.parallelProjection) {
    if (!(camera.parallelScale > 0.0) || !std::isfinite(camera.parallelScale)) {
      throw Error(ErrorCode::InvalidArgument,
                  fmt::format("the parallel scale must be > 0, but is {}", camera.parallelScale));
    }
  } else if (!(camera.viewAngle > 0.0 && camera.viewAngle < 180.0)) {
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("the view angle must lie in (0, 180) degrees, but is {}", camera.viewAngle));
  }
}

}  // namespace

Camera Camera::azimuth(double degrees) const {
  if (degrees == 0.0) return *this;  // exactly
  const glm::dvec3 fromFocal = position - focalPoint;
  const glm::dvec3 axis = unitUp(viewUp);
  const double angle = radians(degrees);
  const double along = glm::dot(axis, fromFocal);  // constant, by Rodrigues' rotation
  Camera turned = *this;
  turned.position = focalPoint + std::cos(angle) * fromFocal + std::sin(angle) * glm::cross(axis, fromFocal) +
                    (1.0 - std::cos(angle)) * along * axis;
  return turned;
}

Camera Camera::framing(const Box& bounds, const glm::dvec3& direction, const glm::dvec3& viewUp,
                       double viewAngle) {
  const double radius = bounds.empty() ? 1.0 : 0.5 * glm::length(bounds.size());
  const glm::dvec3 center = bounds.empty() ? glm::dvec3(0.0) : bounds.center();
  Camera camera;
  camera.focalPoint = center;
  camera.position = center - glm::normalize(direction) * (radius / std::sin(radians(viewAngle) * 0.5));
  camera.viewUp = viewUp;
  camera.viewAngle = viewAngle;
  camera.parallelScale = radius;
  return camera;
}

View::View(const Camera& camera, int width, int height) : camera_(camera), width_(width), height_(height) {
  if (width < 1 || height < 1 || width > View::maxSide || height > View::maxSide) {
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("the viewport must be 1 to {} pixels wide and high, but is {} x {}",
                            View::maxSide, width, height));
  }
  validateCamera(camera);
  forward_ = glm::normalize(camera.focalPoint - camera.position);
  up_ = orthogonalUp(camera.viewUp, forward_);
  right_ = glm::cross(forward_, up_);
  halfHeight_ = camera.parallelProjection ? camera.parallelScale : std::tan(radians(camera.viewAngle) * 0.5);
  halfWidth_ = halfHeight_ * width / height;
  pixelSize_ = glm::dvec2(2.0 * halfHeight_ / height);
}

View::View(const Camera& camera, int width, int height, const ImagePlane& plane)
    : View(camera, width, height) {
  const glm::dvec2 extent = plane.high - plane.low;
  if (!(extent.x > 0.0) || !(extent.y > 0.0) || !isFinite({plane.low, extent.x}) ||
      !isFinite({plane.high, extent.y})) {
    throw Error(ErrorCode::InvalidArgument, "the image plane must be finite and have an extent");
  }
  halfWidth_ = 0.5 * extent.x;
  halfHeight_ = 0.5 * extent.y;
  middle_ = 0.5 * (plane.low + plane.high);
  pixelSize_ = extent / glm::dvec2(width, height);
}

View View::withMargin(const Camera& camera, int width, int height, const glm::ivec2& margin) {
  const View picture(camera, width, height);
  if (margin == glm::ivec2(0)) return picture;  // exactly
  const glm::dvec2 half = glm::dvec2(width, height) + 2.0 * glm::dvec2(margin);
  const glm::dvec2 extent = half * (picture.halfHeight_ / height);
  return {camera, width + 2 * margin.x, height + 2 * margin.y, ImagePlane{-extent, extent}};
}

glm::dvec3 View::toView(const glm::dvec3& world) const {
  const glm::dvec3 fromEye = world - camera_.position;
  return {glm::dot(fromEye, right_), glm::dot(fromEye, up_), glm::dot(fromEye, forward_)};
}

Ray View::rayThrough(double x, double y) const {
  const glm::dvec2 at{(x - 0.5 * width_) * pixelSize_.x + middle_.x,
                      (y - 0.5 * height_) * pixelSize_.y + middle_.y};
  const glm::dvec3 offset = at.x * right_ + at.y * up_;
  if (parallel()) return {camera_.position + offset, forward_};
  return {camera_.position, forward_ + offset};
}

}  // namespace vdi
