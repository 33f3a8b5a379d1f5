// Renders a VDI from a new viewpoint: a ray traverses the frusta of V_O's pixels. The shaders' twin is
// shaders/render.comp.
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "vdi/reference/Accumulator.h"
#include "vdi/reference/Reference.h"
#include "vdi/reference/Slopes.h"

namespace vdi::reference {

namespace {

/// A ray p(t) = origin + t * direction in the view space of V_O; t is the new view's depth.
struct ViewRay {
  glm::dvec3 origin;
  glm::dvec3 direction;
  double worldPerT = 1.0;  // world length per unit of t
};

/// The t at which the ray crosses the plane between pixel columns (or rows) at image coordinate `pixel`. In
/// V_O's view space that plane is  p[axis] = slope * p.z (perspective) or p[axis] = slope (parallel).
double crossing(const ViewRay& ray, const View& view, int axis, int pixel) {
  const double extent = axis == 0 ? view.width() : view.height();
  const double slope = (pixel - 0.5 * extent) * 2.0 * view.halfHeight() / view.height();
  if (view.parallel()) return (slope - ray.origin[axis]) / ray.direction[axis];
  return (slope * ray.origin.z - ray.origin[axis]) / (ray.direction[axis] - slope * ray.direction.z);
}

/// Image coordinates of the point at t; its depth must be > 0.
glm::dvec2 pixelAt(const ViewRay& ray, const View& view, double t) {
  const glm::dvec3 p = ray.origin + t * ray.direction;
  const double scale = 0.5 * view.height() / view.halfHeight() / (view.parallel() ? 1.0 : p.z);
  return {p.x * scale + 0.5 * view.width(), p.y * scale + 0.5 * view.height()};
}

/// The part of the ray inside V_O's frustum between two depths, or an empty interval.
struct Stretch {
  double enter;
  double leave;
  bool empty() const { return !(enter < leave); }
};

/// Keeps the part where value + t * slope >= 0.
void clip(Stretch& stretch, double value, double slope) {
  if (slope > 0.0) {
    stretch.enter = std::max(stretch.enter, -value / slope);
  } else if (slope < 0.0) {
    stretch.leave = std::min(stretch.leave, -value / slope);
  } else if (value < 0.0) {
    stretch.leave = stretch.enter;
  }
}

Stretch insideFrustum(const ViewRay& ray, const View& view, double nearest, double farthest) {
  Stretch stretch{0.0, std::numeric_limits<double>::infinity()};  // the part in front of the new eye
  const glm::dvec2 half{view.halfWidth(), view.halfHeight()};
  for (int axis = 0; axis < 2; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      // side * p[axis] <= half * (p.z or 1)
      const double value = half[axis] * (view.parallel() ? 1.0 : ray.origin.z) - side * ray.origin[axis];
      const double slope =
          half[axis] * (view.parallel() ? 0.0 : ray.direction.z) - side * ray.direction[axis];
      clip(stretch, value, slope);
    }
  }
  clip(stretch, ray.origin.z - nearest, ray.direction.z);
  clip(stretch, farthest - ray.origin.z, -ray.direction.z);
  return stretch;
}

/// A VDI's lists, and the slopes of their faces.
struct LeaningLists {
  const SupersegmentLists& lists;
  std::vector<Slopes> slopes;  // empty: faces do not slope
  float slopeUnit = 0.0F;
  BoxFaces faces{};  // faces of the box around the lists; all 0: of all space
};

/// The part of a ray's stretch that lies within a supersegment, as fractions of the stretch.
struct Fractions {
  double enter = 0.0;
  double leave = 1.0;
  /// Keeps the part where a value that changes evenly from `first` to `last` is at least 0.
  void clip(double first, double last) {
    if (first < 0.0 && last < 0.0) leave = -1.0;
    if (first < 0.0 && last >= 0.0) enter = std::max(enter, first / (first - last));
    if (first >= 0.0 && last < 0.0) leave = std::min(leave, first / (first - last));
  }
};

/// Adds the ray's intersection with a pixel's list.
void addListOf(Accumulator& sum, const LeaningLists& leaning, const View& original, const glm::ivec2& pixel,
               const ViewRay& ray, const Stretch& stretch) {
  const SupersegmentLists& lists = leaning.lists;
  const glm::dvec2 centre = glm::dvec2(pixel) + 0.5;
  const double pixelLength = glm::length(original.rayThrough(centre.x, centre.y).direction);
  const auto index = static_cast<std::size_t>(pixel.y) * static_cast<std::size_t>(original.width()) +
                     static_cast<std::size_t>(pixel.x);
  const std::span<const Supersegment> list = lists.list(index);
  if (list.empty() || stretch.empty()) return;
  const double firstDepth = ray.origin.z + stretch.enter * ray.direction.z;
  const double lastDepth = ray.origin.z + stretch.leave * ray.direction.z;
  const glm::dvec2 first = pixelAt(ray, original, stretch.enter) - centre;
  const glm::dvec2 last = pixelAt(ray, original, stretch.leave) - centre;
  const bool forward = ray.direction.z >= 0.0;
  for (std::size_t place = 0; place < list.size(); ++place) {
    const std::size_t i = forward ? place : list.size() - 1 - place;
    const Supersegment& segment = list[i];
    glm::dvec2 front(0.0);
    glm::dvec2 back(0.0);
    Slopes slopes;
    if (!leaning.slopes.empty()) {
      slopes = leaning.slopes[lists.offsets[index] + i];
      front = static_cast<double>(leaning.slopeUnit) * glm::dvec2(slopes.frontX, slopes.frontY);
      back = static_cast<double>(leaning.slopeUnit) * glm::dvec2(slopes.backX, slopes.backY);
    }
    Fractions part;
    if (!slopes.frontIsOnFace()) {
      part.clip(firstDepth - segment.front - glm::dot(front, first),
                lastDepth - segment.front - glm::dot(front, last));
    }
    if (!slopes.backIsOnFace()) {
      part.clip(segment.back + glm::dot(back, first) - firstDepth,
                segment.back + glm::dot(back, last) - lastDepth);
    }
    if (!(part.enter < part.leave)) continue;
    const double length = stretch.leave - stretch.enter;
    const double met = (part.leave - part.enter) * length * ray.worldPerT;
    const double whole = (segment.back - segment.front) * pixelLength;
    const float opacity = opacityOf(opticalDepthOf(segment.opacity) * static_cast<float>(met / whole));
    const float scale = opacity / segment.opacity;
    sum.add(scale * glm::vec3(segment.red, segment.green, segment.blue), opacity,
            static_cast<float>(stretch.enter + part.enter * length));
  }
}

Accumulator traverseLists(const LeaningLists& lists, const View& original, const ViewRay& ray,
                          const Stretch& stretch) {
  Accumulator sum;
  const glm::dvec2 start = pixelAt(ray, original, stretch.enter);
  const glm::dvec2 end = pixelAt(ray, original, stretch.leave);
  const glm::ivec2 size{original.width(), original.height()};
  glm::ivec2 pixel = glm::clamp(glm::ivec2(glm::floor(start)), glm::ivec2(0), size - 1);
  const glm::ivec2 last = glm::clamp(glm::ivec2(glm::floor(end)), glm::ivec2(0), size - 1);
  const glm::ivec2 step = glm::sign(last - pixel);  // image coordinates are monotone along a ray
  double enter = stretch.enter;
  for (;;) {
    int axis = -1;
    double leave = stretch.leave;
    for (int a = 0; a < 2; ++a) {
      if (pixel[a] == last[a]) continue;
      const double t = crossing(ray, original, a, step[a] > 0 ? pixel[a] + 1 : pixel[a]);
      if (t < leave) {
        leave = t;
        axis = a;
      }
    }
    leave = std::max(leave, enter);
    addListOf(sum, lists, original, pixel, ray, {enter, leave});
    if (axis < 0) return sum;
    pixel[axis] += step[axis];
    enter = leave;
  }
}

/// A weighted blend of several lists.
class Blend {
 public:
  void add(const Accumulator& list, double weight) {
    rgba_ += static_cast<float>(weight) * list.rgba();
    depth_ = std::min(depth_, list.depth());
  }
  void addTo(Accumulator& sum) const { sum.add(glm::vec3(rgba_), rgba_.a, depth_); }

 private:
  glm::vec4 rgba_{0.0F};
  float depth_ = Image::noDepth;
};

/// A point between the centres of two neighbouring lists: the first one's index, and the second one's weight,
/// which is exactly 0 at the first one's centre, despite rounding.
struct BetweenCentres {
  int first;
  double shareOfNext;
  explicit BetweenCentres(double place) : first(static_cast<int>(std::floor(place - 0.5))) {
    constexpr double onCentre = 1.0 / 256.0;
    const double share = place - 0.5 - first;
    shareOfNext = std::clamp((share - onCentre) / (1.0 - 2.0 * onCentre), 0.0, 1.0);
  }
  double weight(int side) const { return side == 0 ? 1.0 - shareOfNext : shareOfNext; }
};

/// Intersects a ray that stays near one position of V_O's picture with the four lists around it.
Accumulator intersectAlongLists(const LeaningLists& lists, const View& original, const ViewRay& ray,
                                const Stretch& stretch, const glm::dvec2& place) {
  const BetweenCentres x(place.x);
  const BetweenCentres y(place.y);
  const glm::ivec2 size{original.width(), original.height()};
  Blend blend;
  for (const glm::ivec2& side : {glm::ivec2(0, 0), glm::ivec2(1, 0), glm::ivec2(0, 1), glm::ivec2(1, 1)}) {
    const double weight = x.weight(side.x) * y.weight(side.y);
    if (weight == 0.0) continue;
    Accumulator part;
    const glm::ivec2 pixel = glm::clamp(glm::ivec2(x.first, y.first) + side, glm::ivec2(0), size - 1);
    addListOf(part, lists, original, pixel, ray, stretch);
    blend.add(part, weight);
  }
  Accumulator sum;
  blend.addTo(sum);
  return sum;
}

/// Reconstruction::Smooth and Sheared. Goes column by column, or row by row if the ray crosses more rows. The
/// ray then stays near the same two lists of each column, which are blended. Blending across columns as well
/// gains nothing (measured), except where the ray crosses hardly any.
Accumulator traverseSmoothly(const LeaningLists& lists, const View& original, const ViewRay& ray,
                             const Stretch& stretch) {
  const glm::dvec2 start = pixelAt(ray, original, stretch.enter);
  const glm::dvec2 end = pixelAt(ray, original, stretch.leave);
  const glm::dvec2 extent = glm::abs(end - start);
  const int along = 1.001 * extent.x >= extent.y ? 0 : 1;  // diagonals: by columns, despite rounding
  const int across = 1 - along;
  if (extent[along] < 1.0) return intersectAlongLists(lists, original, ray, stretch, 0.5 * (start + end));
  Accumulator sum;
  const glm::ivec2 size{original.width(), original.height()};
  int column = std::clamp(static_cast<int>(std::floor(start[along])), 0, size[along] - 1);
  const int last = std::clamp(static_cast<int>(std::floor(end[along])), 0, size[along] - 1);
  const int step = last > column ? 1 : -1;
  double enter = stretch.enter;
  double place = start[across];
  for (;;) {
    double leave = stretch.leave;
    if (column != last) {
      const double t = crossing(ray, original, along, step > 0 ? column + 1 : column);
      leave = std::clamp(t, enter, stretch.leave);
    }
    const double nextPlace = pixelAt(ray, original, leave)[across];
    const BetweenCentres between(0.5 * (place + nextPlace));
    Blend blend;
    for (const int side : {0, 1}) {
      if (between.weight(side) == 0.0) continue;
      glm::ivec2 pixel;
      pixel[along] = column;
      pixel[across] = std::clamp(between.first + side, 0, size[across] - 1);
      Accumulator part;
      addListOf(part, lists, original, pixel, ray, {enter, leave});
      blend.add(part, between.weight(side));
    }
    blend.addTo(sum);
    if (column == last) return sum;
    column += step;
    enter = leave;
    place = nextPlace;
  }
}

}  // namespace

Image render(const Vdi& vdi, const View& view, Reconstruction reconstruction, std::span<const float> ends,
             std::span<const ClipPlane> planes) {
  Image image = blankImage(view.width(), view.height());
  assert(ends.empty() || ends.size() == image.pixelCount());
  const SupersegmentLists lists = vdi.expandedLists();
  if (lists.segments.empty()) return image;
  const View original = vdi.view();
  float nearest = std::numeric_limits<float>::infinity();
  float farthest = 0.0F;
  for (const Supersegment& segment : lists.segments) {
    nearest = std::min(nearest, segment.front);
    farthest = std::max(farthest, segment.back);
  }
  // In perspective, the frusta of V_O's pixels meet in its eye, where depths cannot separate them.
  if (!original.parallel()) nearest = std::max(nearest, farthest * 1e-6F);
  LeaningLists leaning{lists, {}};
  if (reconstruction == Reconstruction::Sheared) {
    const SlopeUnit unit = slopeUnitOf(original, nearest, farthest);
    const ListBox box = listBoxOf(vdi, farthest);
    leaning.slopes = slopesOf(lists, original, unit, box);
    leaning.slopeUnit = unit.unit;
    leaning.faces = box.faces;
  }
  for (int y = 0; y < view.height(); ++y) {
    for (int x = 0; x < view.width(); ++x) {
      const Ray world = view.rayThrough(x + 0.5, y + 0.5);
      const glm::dvec3 direction{glm::dot(world.direction, original.right()),
                                 glm::dot(world.direction, original.up()),
                                 glm::dot(world.direction, original.forward())};
      const ViewRay ray{original.toView(world.origin), direction, glm::length(world.direction)};
      const auto pixel =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x);
      Stretch stretch = insideFrustum(ray, original, nearest, farthest);
      for (const ClipPlane& plane : planes) {
        const glm::dvec3 normal = glm::normalize(plane.normal);
        clip(stretch, glm::dot(normal, world.origin - plane.origin), glm::dot(normal, world.direction));
      }
      // Lists reach to the box's faces, and may reach beyond.
      for (const glm::dvec4& face : leaning.faces)
        clip(stretch, glm::dot(glm::dvec3(face), ray.origin) - face.w, glm::dot(glm::dvec3(face), direction));
      if (!ends.empty()) stretch.leave = std::min(stretch.leave, static_cast<double>(ends[pixel]));
      if (stretch.empty()) continue;
      const Accumulator sum = reconstruction == Reconstruction::Constant
                                  ? traverseLists(leaning, original, ray, stretch)
                                  : traverseSmoothly(leaning, original, ray, stretch);
      image.rgba[pixel] = sum.rgba();
      image.depth[pixel] = sum.depth();
    }
  }
  return image;
}

}  // namespace vdi::reference
