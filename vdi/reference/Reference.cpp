#include "vdi/reference/Reference.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace vdi::reference {

namespace {

/// Colour and opacity accumulated front to back, and the depth of what came first.
class Accumulator {
 public:
  void add(const glm::vec3& color, float opacity, float depth) {
    if (!(opacity > 0.0F)) return;
    if (rgba_.a == 0.0F) depth_ = depth;
    rgba_ += (1.0F - rgba_.a) * glm::vec4(color, opacity);
  }
  const glm::vec4& rgba() const { return rgba_; }
  float depth() const { return depth_; }

 private:
  glm::vec4 rgba_{0.0F};
  float depth_ = Image::noDepth;
};

Image blankImage(int width, int height) {
  Image image{width, height, {}, {}};
  image.rgba.resize(image.pixelCount(), glm::vec4(0.0F));
  image.depth.resize(image.pixelCount(), Image::noDepth);
  return image;
}

// ---- sampling a block
// ------------------------------------------------------------------------------------------------

struct SceneRay {
  glm::vec3 start;  // relative to the scene's centre, at the front of the sample lattice
  glm::vec3 direction;
  float step;

  glm::vec3 sample(std::uint32_t k) const {
    return start + (static_cast<float>(k) + 0.5F) * step * direction;
  }
};

SceneRay rayOf(const Frame& frame, int x, int y) {
  const Ray ray = frame.view.rayThrough(x + 0.5, y + 0.5);
  const glm::dvec3 start = ray.origin + frame.lattice.first * ray.direction - frame.scene.bounds.center();
  return {glm::vec3(start), glm::vec3(ray.direction), static_cast<float>(frame.lattice.step)};
}

struct OwnedBox {
  glm::vec3 lo;
  glm::vec3 hi;
  bool contains(const glm::vec3& p) const {
    return p.x >= lo.x && p.y >= lo.y && p.z >= lo.z && p.x < hi.x && p.y < hi.y && p.z < hi.z;
  }
};

OwnedBox ownedBox(const Scene& scene, const Block& block) {
  OwnedBox box;
  for (int axis = 0; axis < 3; ++axis) {
    box.lo[axis] = snapToScene(scene, block.owned.lo[axis], axis);
    box.hi[axis] = snapToScene(scene, block.owned.hi[axis], axis);
  }
  return box;
}

double interpolate(const Block& block, const glm::dvec3& world) {
  const glm::dvec3 last = glm::dvec3(block.dims - 1);
  const glm::dvec3 position = glm::clamp((world - block.origin) / block.spacing, glm::dvec3(0.0), last);
  const glm::ivec3 base = glm::min(glm::ivec3(position), glm::max(block.dims - 2, glm::ivec3(0)));
  const glm::dvec3 share = position - glm::dvec3(base);
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::ivec3 step{corner & 1, (corner >> 1) & 1, (corner >> 2) & 1};
    const glm::dvec3 weight = glm::mix(1.0 - share, share, glm::dvec3(step));
    const double product = weight.x * weight.y * weight.z;
    const glm::ivec3 at = glm::min(base + step, block.dims - 1);
    if (product > 0.0) sum += product * valueAt(block, at.x, at.y, at.z);
  }
  return sum;
}

/// Indices of the samples in the box: one range, because each coordinate is monotone along the ray.
struct SampleRange {
  std::uint32_t first = 0;
  std::uint32_t last = 0;  // exclusive
};

SampleRange samplesIn(const OwnedBox& box, const SceneRay& ray, std::uint32_t count) {
  // Where the ray is in the box, in units of samples, with two samples to spare; then exactly, sample by
  // sample.
  float enter = 0.0F;
  auto leave = static_cast<float>(count);
  for (int axis = 0; axis < 3; ++axis) {
    if (ray.direction[axis] == 0.0F) continue;
    const float a = (box.lo[axis] - ray.start[axis]) / (ray.direction[axis] * ray.step);
    const float b = (box.hi[axis] - ray.start[axis]) / (ray.direction[axis] * ray.step);
    const float spare = 2.0F + 1e-6F * std::max(std::abs(a), std::abs(b));
    enter = std::max(enter, std::min(a, b) - spare);
    leave = std::min(leave, std::max(a, b) + spare);
  }
  SampleRange range;
  if (!(enter < leave)) return range;
  range.first = static_cast<std::uint32_t>(enter);
  range.last = std::min(count, static_cast<std::uint32_t>(std::ceil(leave)));
  while (range.first < range.last && !box.contains(ray.sample(range.first))) ++range.first;
  while (range.last > range.first && !box.contains(ray.sample(range.last - 1))) --range.last;
  return range;
}

/// The scene's bounds seldom lie half-way between two samples: the first sample's interval starts where the
/// ray enters them, the last one's ends where it leaves. Depends on ray and scene alone, so it's the same on
/// every rank.
struct SceneStretch {
  SampleRange samples;
  float enter = 0.0F;  // depth
  float leave = 0.0F;
};

SceneStretch sceneStretch(const Frame& frame, const SceneRay& ray) {
  OwnedBox box;
  for (int axis = 0; axis < 3; ++axis) {
    box.lo[axis] = snapToScene(frame.scene, frame.scene.bounds.lo[axis], axis);
    box.hi[axis] = snapToScene(frame.scene, frame.scene.bounds.hi[axis], axis);
  }
  float enter = 0.0F;
  float leave = static_cast<float>(frame.lattice.count) * ray.step;
  for (int axis = 0; axis < 3; ++axis) {
    if (ray.direction[axis] == 0.0F) continue;
    const float a = (box.lo[axis] - ray.start[axis]) / ray.direction[axis];
    const float b = (box.hi[axis] - ray.start[axis]) / ray.direction[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  SceneStretch stretch;
  stretch.samples = samplesIn(box, ray, frame.lattice.count);
  const float first = (static_cast<float>(stretch.samples.first) + 0.5F) * ray.step;
  const float last = (static_cast<float>(stretch.samples.last) - 0.5F) * ray.step;
  const auto front = static_cast<float>(frame.lattice.first);
  stretch.enter = front + std::clamp(enter, first - ray.step, first);
  stretch.leave = front + std::clamp(leave, last, last + ray.step);
  stretch.leave = std::max(stretch.leave, stretch.enter + 0.001F * ray.step);
  return stretch;
}

// ---- walking a ray through a VDI
// -----------------------------------------------------------------------------------------

/// A ray p(t) = origin + t * direction in the view space of V_O, t being the new view's depth.
struct ViewRay {
  glm::dvec3 origin;
  glm::dvec3 direction;
  double worldPerT = 1.0;  // world length per unit of t
};

/// Where the ray crosses the plane between pixel columns (or rows) at image coordinate `pixel`. In V_O's view
/// space that plane is  p[axis] = slope * p.z (perspective) or p[axis] = slope (parallel).
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

/// Keeps what satisfies value + t * slope >= 0.
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
  Stretch stretch{0.0, std::numeric_limits<double>::infinity()};  // nothing behind the new eye
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

/// Adds what the ray meets of one list between enter and leave.
void addList(Accumulator& sum, std::span<const Supersegment> list, const ViewRay& ray, double pixelLength,
             const Stretch& stretch) {
  const auto depthAt = [&](double t) { return ray.origin.z + t * ray.direction.z; };
  const double nearDepth = std::min(depthAt(stretch.enter), depthAt(stretch.leave));
  const double farDepth = std::max(depthAt(stretch.enter), depthAt(stretch.leave));
  const bool forward = ray.direction.z >= 0.0;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const Supersegment& segment = forward ? list[i] : list[list.size() - 1 - i];
    Stretch part = stretch;
    clip(part, ray.origin.z - segment.front, ray.direction.z);
    clip(part, segment.back - ray.origin.z, -ray.direction.z);
    if (segment.back <= nearDepth || segment.front >= farDepth || part.empty()) continue;
    const double met = (part.leave - part.enter) * ray.worldPerT;
    const double whole = (segment.back - segment.front) * pixelLength;
    const float opacity = opacityOf(opticalDepthOf(segment.opacity) * static_cast<float>(met / whole));
    const float scale = opacity / segment.opacity;
    sum.add(scale * glm::vec3(segment.red, segment.green, segment.blue), opacity,
            static_cast<float>(part.enter));
  }
}

Accumulator walkLists(const SupersegmentLists& lists, const View& original, const ViewRay& ray,
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
    const Ray pixelRay = original.rayThrough(pixel.x + 0.5, pixel.y + 0.5);
    const auto list = lists.list(static_cast<std::size_t>(pixel.y) * static_cast<std::size_t>(size.x) +
                                 static_cast<std::size_t>(pixel.x));
    addList(sum, list, ray, glm::length(pixelRay.direction), {enter, leave});
    if (axis < 0) return sum;
    pixel[axis] += step[axis];
    enter = leave;
  }
}

}  // namespace

Frame::Frame(const Scene& theScene, const Camera& camera, const TransferFunction& transferFunction,
             const GenerateSettings& theSettings)
    : scene(theScene),
      view(camera, theSettings.width, theSettings.height),
      lattice(depthLattice(theScene, view, theSettings.samplesPerVoxel)),
      table(bake(transferFunction)),
      settings(theSettings) {
  validate(theSettings);
}

std::vector<Interval> castRay(const Frame& frame, std::span<const Block> blocks, int x, int y,
                              std::uint32_t atOnce) {
  struct Piece {
    SampleRange range;
    const Block* block;
  };
  const SceneRay ray = rayOf(frame, x, y);
  std::vector<Piece> pieces;
  for (const Block& block : blocks) {
    if (block.owned.empty()) continue;
    const SampleRange range = samplesIn(ownedBox(frame.scene, block), ray, frame.lattice.count);
    if (range.first < range.last) pieces.push_back({range, &block});
  }
  std::sort(pieces.begin(), pieces.end(),
            [](const Piece& a, const Piece& b) { return a.range.first < b.range.first; });

  const SceneStretch scene = sceneStretch(frame, ray);
  const float unitsPerDepth = glm::length(ray.direction) / static_cast<float>(frame.table.unitDistance);
  const float enough = opticalDepthOf(static_cast<float>(frame.settings.terminationOpacity));
  std::vector<Interval> samples;
  float total = 0.0F;
  for (const Piece& piece : pieces) {
    const std::uint32_t first = (piece.range.first + atOnce - 1) / atOnce * atOnce;
    for (std::uint32_t k = first; k < piece.range.last; k += atOnce) {
      const std::uint32_t end = std::min(k + atOnce, scene.samples.last);
      const glm::dvec3 world = glm::dvec3(ray.sample(k)) + frame.scene.bounds.center();
      const TransferTableEntry entry = frame.table.lookup(interpolate(*piece.block, world));
      const float front =
          k == scene.samples.first ? scene.enter : static_cast<float>(frame.lattice.frontOf(k));
      const float back =
          end == scene.samples.last ? scene.leave : static_cast<float>(frame.lattice.frontOf(end));
      const float opticalDepth = std::min(entry.extinction * unitsPerDepth * (back - front), maxExtinction);
      const float opacity = opacityOf(opticalDepth);
      samples.push_back(
          {front, back, entry.red * opacity, entry.green * opacity, entry.blue * opacity, opticalDepth});
      total += opticalDepth;
      if (total >= enough) return samples;
    }
  }
  return samples;
}

Image renderVolume(const Frame& frame, std::span<const Block> blocks) {
  Image image = blankImage(frame.view.width(), frame.view.height());
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      Accumulator sum;
      for (const Interval& sample : castRay(frame, blocks, x, y)) {
        sum.add({sample.red, sample.green, sample.blue}, opacityOf(sample.opticalDepth), sample.front);
      }
      const auto pixel =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x);
      image.rgba[pixel] = sum.rgba();
      image.depth[pixel] = sum.depth();
    }
  }
  return image;
}

SupersegmentLists generate(const Frame& frame, std::span<const Block> blocks, bool cutAtGaps) {
  const SegmentRules rules{frame.settings.supersegments, static_cast<float>(frame.lattice.step), cutAtGaps};
  const int width = frame.view.width();
  const int height = frame.view.height();
  SupersegmentLists lists;
  const std::uint32_t atOnce = countedSamplesFor(frame.lattice.count, rules.budget);
  const auto allotmentAt = [&](int x, int y) {
    return allotmentOf(castRay(frame, blocks, x, y, atOnce), rules, atOnce);
  };
  const auto listAt = [&](int x, int y) {
    const std::vector<Interval> samples = castRay(frame, blocks, x, y);
    if (frame.settings.algorithm == Algorithm::Bisection) return segmentByBisection(samples, rules);
    if (cutAtGaps) return segmentByMerging(samples, rules);
    // The counted lists left and right, below and above; the last ones where there's none beyond.
    const auto before = [](int i) { return i - i % countedStride; };
    const auto after = [&](int i, int size) {
      const int next = before(i + countedStride - 1);
      return next < size ? next : before(i);
    };
    const int left = before(x);
    const int right = after(x, width);
    const int below = before(y);
    const int above = after(y, height);
    const Allotment counted[] = {allotmentAt(left, below), allotmentAt(right, below),
                                 allotmentAt(left, above), allotmentAt(right, above)};
    return segmentByMerging(samples, rules, allotmentBetween(counted));
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto list = listAt(x, y);
      lists.segments.insert(lists.segments.end(), list.begin(), list.end());
      lists.offsets.push_back(static_cast<std::uint32_t>(lists.segments.size()));
    }
  }
  return lists;
}

SupersegmentLists composite(std::span<const SupersegmentLists> subLists, std::uint32_t budget,
                            double sampleStep, Algorithm algorithm) {
  const SegmentRules rules{budget, static_cast<float>(sampleStep), false};
  SupersegmentLists result;
  const std::size_t listCount = subLists.empty() ? 0 : subLists.front().listCount();
  for (std::size_t i = 0; i < listCount; ++i) {
    std::vector<Interval> merged;
    for (const SupersegmentLists& sub : subLists) {
      assert(sub.listCount() == listCount);
      for (const Supersegment& s : sub.list(i)) {
        merged.push_back({s.front, s.back, s.red, s.green, s.blue, opticalDepthOf(s.opacity)});
      }
    }
    std::stable_sort(merged.begin(), merged.end(),
                     [](const Interval& a, const Interval& b) { return a.front < b.front; });
    const auto list = segment(merged, rules, algorithm);
    result.segments.insert(result.segments.end(), list.begin(), list.end());
    result.offsets.push_back(static_cast<std::uint32_t>(result.segments.size()));
  }
  return result;
}

Image render(const Vdi& vdi, const View& view) {
  Image image = blankImage(view.width(), view.height());
  const SupersegmentLists lists = vdi.expandedLists();
  if (lists.segments.empty()) return image;
  const View original = vdi.view();
  float nearest = std::numeric_limits<float>::infinity();
  float farthest = 0.0F;
  for (const Supersegment& segment : lists.segments) {
    nearest = std::min(nearest, segment.front);
    farthest = std::max(farthest, segment.back);
  }
  // In perspective the frusta of V_O's pixels meet in its eye; nothing can be told apart there.
  const double smallest = original.parallel() ? nearest : std::max(nearest, farthest * 1e-6F);
  for (int y = 0; y < view.height(); ++y) {
    for (int x = 0; x < view.width(); ++x) {
      const Ray world = view.rayThrough(x + 0.5, y + 0.5);
      const glm::dvec3 direction{glm::dot(world.direction, original.right()),
                                 glm::dot(world.direction, original.up()),
                                 glm::dot(world.direction, original.forward())};
      const ViewRay ray{original.toView(world.origin), direction, glm::length(world.direction)};
      const Stretch stretch = insideFrustum(ray, original, smallest, farthest);
      if (stretch.empty()) continue;
      const Accumulator sum = walkLists(lists, original, ray, stretch);
      const auto pixel =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x);
      image.rgba[pixel] = sum.rgba();
      image.depth[pixel] = sum.depth();
    }
  }
  return image;
}

}  // namespace vdi::reference
