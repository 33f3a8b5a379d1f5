#include "vdi/core/Viewpoint.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace vdi {

namespace {

/// Whether all corners lie on the outer side of one of the planes that bound what the view shows.
bool outside(const Box& bounds, const View& view) {
  // How many corners are left of, right of, below, above and behind the picture.
  std::array<int, 5> beyond{};
  constexpr int corners = 8;
  for (int corner = 0; corner < corners; ++corner) {
    const glm::dvec3 p = view.toView({(corner & 1) != 0 ? bounds.hi.x : bounds.lo.x,
                                      (corner & 2) != 0 ? bounds.hi.y : bounds.lo.y,
                                      (corner & 4) != 0 ? bounds.hi.z : bounds.lo.z});
    const double depth = view.parallel() ? 1.0 : p.z;
    const double width = view.halfWidth() * depth;
    const double height = view.halfHeight() * depth;
    const std::array<bool, 5> sides{p.x<-width, p.x> width, p.y<-height, p.y> height, p.z <= 0.0};
    for (std::size_t side = 0; side < sides.size(); ++side) beyond[side] += sides[side] ? 1 : 0;
  }
  for (const int count : beyond) {
    if (count == corners) return true;
  }
  return false;
}

/// From the camera to `point`, or along the axis if it projects in parallel; unit.
glm::dvec3 directionTo(const glm::dvec3& point, const Camera& camera) {
  const glm::dvec3 way =
      camera.parallelProjection ? camera.focalPoint - camera.position : point - camera.position;
  const double length = glm::length(way);
  return length > 0.0 ? way / length : glm::dvec3(0.0, 0.0, -1.0);
}

}  // namespace

std::optional<ViewpointIssue> viewpointIssue(const Box& bounds, const Camera& original, const View& view) {
  if (bounds.empty()) return std::nullopt;
  const glm::dvec3& eye = view.camera().position;
  const auto within = [&](int axis) { return bounds.lo[axis] < eye[axis] && eye[axis] < bounds.hi[axis]; };
  const bool elsewhere = eye != original.position;
  if (elsewhere && within(0) && within(1) && within(2)) return ViewpointIssue::Inside;
  if (outside(bounds, view)) return ViewpointIssue::SeesNothing;
  const double depth = view.parallel() ? 1.0 : view.toView(bounds.center()).z;
  const double diameter = glm::length(bounds.size()) / (2.0 * view.halfHeight() * depth) * view.height();
  if (depth > 0.0 && diameter < farAwayPixels) return ViewpointIssue::FarAway;
  if (degreesBetween(bounds, original, view.camera()) > farBesideDegrees) return ViewpointIssue::FarBeside;
  return std::nullopt;
}

double degreesBetween(const Box& bounds, const Camera& original, const Camera& camera) {
  const glm::dvec3 center = bounds.center();
  const double cosine = glm::dot(directionTo(center, original), directionTo(center, camera));
  return std::acos(std::clamp(cosine, -1.0, 1.0)) * 180.0 / std::numbers::pi;
}

std::string describe(ViewpointIssue issue) {
  switch (issue) {
    case ViewpointIssue::Inside:
      return "the viewpoint is inside the VDI's scene; move it outside, what is behind it isn't seen";
    case ViewpointIssue::SeesNothing:
      return "the viewpoint doesn't see the VDI's scene, which lies behind the camera or beside the picture";
    case ViewpointIssue::FarAway:
      return "the viewpoint is so far away that the VDI's scene is a dot; move it nearer";
    case ViewpointIssue::FarBeside:
      return fmt::format(
          "the viewpoint is more than {:.0f} degrees from where the VDI was made, so the picture is rough; "
          "make a VDI from nearer",
          farBesideDegrees);
  }
  return {};
}

}  // namespace vdi
