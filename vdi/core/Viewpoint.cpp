#include "vdi/core/Viewpoint.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

namespace vdi {

namespace {

using Corners = std::array<glm::dvec3, 8>;

Corners cornersOf(const Box& bounds) {
  Corners corners;
  for (std::size_t corner = 0; corner < corners.size(); ++corner) {
    corners[corner] = {(corner & 1U) != 0 ? bounds.hi.x : bounds.lo.x,
                       (corner & 2U) != 0 ? bounds.hi.y : bounds.lo.y,
                       (corner & 4U) != 0 ? bounds.hi.z : bounds.lo.z};
  }
  return corners;
}

/// Corners of the part of the view's frustum at the scene's depths.
Corners cornersOf(const View& view, const Corners& scene) {
  double near = std::numeric_limits<double>::infinity();
  double far = 0.0;
  for (const glm::dvec3& corner : scene) {
    const double depth = std::max(view.depthOf(corner), 0.0);
    near = std::min(near, depth);
    far = std::max(far, depth);
  }
  Corners corners;
  for (std::size_t corner = 0; corner < corners.size(); ++corner) {
    const Ray ray =
        view.rayThrough((corner & 1U) != 0 ? view.width() : 0, (corner & 2U) != 0 ? view.height() : 0);
    corners[corner] = ray.origin + ((corner & 4U) != 0 ? far : near) * ray.direction;
  }
  return corners;
}

/// Whether all corners lie on the outer side of one of the view frustum's planes.
bool areOutside(const Corners& corners, const View& view) {
  // Number of corners left of, right of, below, above and behind the picture.
  std::array<std::size_t, 5> beyond{};
  for (const glm::dvec3& corner : corners) {
    const glm::dvec3 p = view.toView(corner);
    const double depth = view.parallel() ? 1.0 : p.z;
    const glm::dvec2 middle = view.middle() * depth;
    const double width = view.halfWidth() * depth;
    const double height = view.halfHeight() * depth;
    const std::array<bool, 5> sides{p.x<middle.x - width, p.x> middle.x + width,
                                    p.y<middle.y - height, p.y> middle.y + height, p.z <= 0.0};
    for (std::size_t side = 0; side < sides.size(); ++side) beyond[side] += sides[side] ? 1 : 0;
  }
  return std::ranges::find(beyond, corners.size()) != beyond.end();
}

/// Unit direction from the camera to `point`, or along the view axis in parallel projection.
glm::dvec3 directionTo(const glm::dvec3& point, const Camera& camera) {
  const glm::dvec3 way =
      camera.parallelProjection ? camera.focalPoint - camera.position : point - camera.position;
  const double length = glm::length(way);
  return length > 0.0 ? way / length : glm::dvec3(0.0, 0.0, -1.0);
}

}  // namespace

std::optional<ViewpointIssue> viewpointIssue(const Box& bounds, const View& original, const View& view) {
  if (bounds.empty()) return std::nullopt;
  const Corners scene = cornersOf(bounds);
  if (areOutside(scene, view) || areOutside(cornersOf(original, scene), view))
    return ViewpointIssue::SeesNothing;
  const glm::dvec3& eye = view.camera().position;
  const auto within = [&](int axis) { return bounds.lo[axis] < eye[axis] && eye[axis] < bounds.hi[axis]; };
  const double rounding = 1e-6 * glm::length(bounds.size());
  const bool elsewhere = glm::distance(eye, original.camera().position) > rounding;
  if (elsewhere && within(0) && within(1) && within(2)) return ViewpointIssue::Inside;
  const double depth = view.parallel() ? 1.0 : view.toView(bounds.center()).z;
  const double diameter = glm::length(bounds.size()) / (2.0 * view.halfHeight() * depth) * view.height();
  if (depth > 0.0 && diameter < farAwayPixels) return ViewpointIssue::FarAway;
  if (degreesBetween(bounds, original.camera(), view.camera()) > farBesideDegrees)
    return ViewpointIssue::FarBeside;
  return std::nullopt;
}

double degreesBetween(const Box& bounds, const Camera& original, const Camera& camera) {
  const glm::dvec3 center = bounds.center();
  const double cosine = glm::dot(directionTo(center, original), directionTo(center, camera));
  return std::acos(std::clamp(cosine, -1.0, 1.0)) * 180.0 / std::numbers::pi;
}

double listsAcross(const Box& bounds, const View& original, const View& view) {
  const auto halfWidthAt = [&](const View& at) {
    return at.halfWidth() * (at.parallel() ? 1.0 : std::max(at.toView(bounds.center()).z, 0.0));
  };
  const double all = halfWidthAt(original);
  return all > 0.0 ? original.width() * halfWidthAt(view) / all : 0.0;
}

std::string describe(ViewpointIssue issue) {
  switch (issue) {
    case ViewpointIssue::Inside:
      return "the viewpoint is inside the VDI's scene; move it outside to see what lies behind it";
    case ViewpointIssue::SeesNothing:
      return "the viewpoint doesn't see the VDI, which lies behind the camera or beside the picture";
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
