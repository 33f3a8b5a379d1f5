#include "vdi/reference/Reference.h"

#include <algorithm>
#include <cmath>

#include "vdi/core/Margin.h"
#include "vdi/core/SettingsTable.h"
#include "vdi/reference/Accumulator.h"
#include "vdi/reference/Region.h"
#include "vdi/reference/Shading.h"

namespace vdi::reference {

namespace {

struct SceneRay {
  glm::vec3 start;  // relative to the scene's centre, at the front of the sample lattice
  glm::vec3 direction;
  float step;
  /// Distance from a sample's start to the point that decides its owner: its middle, except for rays that
  /// graze the scene.
  float middle = 0.5F;

  /// `place` counts samples: k is the start of sample k.
  glm::vec3 at(float place) const { return start + place * step * direction; }
  float middleOf(std::uint32_t k) const { return static_cast<float>(k) + middle; }
  glm::vec3 sample(std::uint32_t k) const { return at(middleOf(k)); }
};

SceneRay rayOf(const RayInputs& inputs, int x, int y) {
  const Ray ray = inputs.view.rayThrough(x + 0.5, y + 0.5);
  const glm::dvec3 start = ray.origin + inputs.lattice.first * ray.direction - inputs.scene.bounds.center();
  return {glm::vec3(start), glm::vec3(ray.direction), static_cast<float>(inputs.lattice.step)};
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

/// Indices of the samples in the box; one range, because each coordinate is monotone along the ray.
struct SampleRange {
  std::uint32_t first = 0;
  std::uint32_t last = 0;  // exclusive
};

SampleRange samplesIn(const OwnedBox& box, const SceneRay& ray, std::uint32_t count) {
  // Finds the part of the ray in the box, in units of samples, with two samples to spare; then narrows it
  // sample by sample.
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

/// The samples whose middle lies in the part.
SampleRange clippedSamples(const SampleRange& samples, const RayPart& part, float step, std::uint32_t count) {
  const auto firstBehind = [&](float depth) {
    const float place = std::ceil(depth / step - 0.5F);
    return static_cast<std::uint32_t>(std::clamp(place, 0.0F, static_cast<float>(count)));
  };
  const SampleRange inside{std::max(samples.first, firstBehind(part.enter)),
                           std::min(samples.last, firstBehind(part.leave))};
  return inside.first < inside.last ? inside : SampleRange{};
}

/// The bounds of the visible part (scene or region) seldom lie half-way between two samples: the first
/// sample's interval starts where the ray enters them, the last one's ends where it leaves. If a ray leaves
/// them before it reaches the middle of any sample, the part between is one sample, and its middle decides
/// its owner. This depends only on ray and scene, so it is the same on every rank.
struct SceneStretch {
  SampleRange samples;
  float enter = 0.0F;  // depth
  float leave = 0.0F;
};

/// Moves the middles of the ray's samples if it grazes the bounds.
SceneStretch sceneStretch(const RayInputs& inputs, SceneRay& ray) {
  const Region& region = inputs.settings.region;
  const Box shown = boundsIn(region, inputs.scene.bounds);
  OwnedBox box;
  for (int axis = 0; axis < 3; ++axis) {
    box.lo[axis] = snapToScene(inputs.scene, shown.lo[axis], axis);
    box.hi[axis] = snapToScene(inputs.scene, shown.hi[axis], axis);
  }
  float enter = 0.0F;
  float leave = static_cast<float>(inputs.lattice.count) * ray.step;
  for (int axis = 0; axis < 3; ++axis) {
    if (ray.direction[axis] == 0.0F) continue;
    const float a = (box.lo[axis] - ray.start[axis]) / ray.direction[axis];
    const float b = (box.hi[axis] - ray.start[axis]) / ray.direction[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  SceneStretch stretch;
  stretch.samples = samplesIn(box, ray, inputs.lattice.count);
  if (!region.planes.empty()) {
    const RayPart part =
        clipped(region.planes, inputs.scene.bounds.center(), ray.start, ray.direction, {enter, leave});
    enter = part.enter;
    leave = part.leave;
    stretch.samples = clippedSamples(stretch.samples, part, ray.step, inputs.lattice.count);
  }
  const bool grazes = stretch.samples.first >= stretch.samples.last && enter < leave;
  if (grazes) {
    const float middle = 0.5F * (enter + leave) / ray.step;
    const std::uint32_t k = std::min(static_cast<std::uint32_t>(middle), inputs.lattice.count - 1);
    ray.middle = middle - static_cast<float>(k);
    stretch.samples = box.contains(ray.sample(k)) ? SampleRange{k, k + 1} : SampleRange{};
  }
  const float first = (static_cast<float>(stretch.samples.first) + 0.5F) * ray.step;
  const float last = (static_cast<float>(stretch.samples.last) - 0.5F) * ray.step;
  const auto front = static_cast<float>(inputs.lattice.first);
  stretch.enter = front + (grazes ? enter : std::clamp(enter, first - ray.step, first));
  stretch.leave = front + (grazes ? leave : std::clamp(leave, last, last + ray.step));
  stretch.leave = std::max(stretch.leave, stretch.enter + 0.001F * ray.step);
  return stretch;
}

}  // namespace

RayInputs::RayInputs(const Scene& theScene, const Camera& camera, const TransferFunction& transferFunction,
                     const GenerateSettings& theSettings)
    : scene(theScene),
      view(viewWithMargin(theScene, camera, theSettings)),
      lattice(depthLattice(theScene, view, theSettings.samplesPerVoxel)),
      table(bake(transferFunction)),
      function(transferFunction),
      settings(theSettings),
      slabs(samplesAreSlabs(theScene, view, lattice)),
      reach(static_cast<float>(outermostReach(theScene, lattice))),
      slabTable(makeSlabTable(table, slabLength(lattice, table))),
      isosurfaces(isosurfacesOf(theSettings.blending, table)) {
  validate(theSettings);
}

namespace {

/// A ray's samples that some blocks own, and the scalars along it.
class SampledRay {
 public:
  struct OwnedSamples {
    SampleRange range;
    const Block* block;
  };

  SampledRay(const RayInputs& inputs, std::span<const Block> blocks, int x, int y)
      : inputs_(inputs), ray_(rayOf(inputs, x, y)), scene_(sceneStretch(inputs, ray_)) {
    for (const Block& block : blocks) {
      if (block.owned.empty()) continue;
      SampleRange range = samplesIn(ownedBox(inputs.scene, block), ray_, inputs.lattice.count);
      range = {std::max(range.first, scene_.samples.first), std::min(range.last, scene_.samples.last)};
      if (range.first < range.last) owned_.push_back({range, &block});
    }
    std::sort(owned_.begin(), owned_.end(),
              [](const OwnedSamples& a, const OwnedSamples& b) { return a.range.first < b.range.first; });
  }

  /// Front to back.
  const std::vector<OwnedSamples>& owned() const { return owned_; }
  const SampleRange& inScene() const { return scene_.samples; }
  float frontOf(std::uint32_t k) const {
    return k == scene_.samples.first ? scene_.enter : static_cast<float>(inputs_.lattice.frontOf(k));
  }
  /// The back of the sample before `end`.
  float backOf(std::uint32_t end) const {
    return end == scene_.samples.last ? scene_.leave : static_cast<float>(inputs_.lattice.frontOf(end));
  }
  /// The places at which sample k is classified, its two ends or its middle.
  float beginOf(std::uint32_t k) const { return inputs_.slabs ? placeOf(k) : ray_.middleOf(k); }
  float endOf(std::uint32_t k) const { return inputs_.slabs ? placeOf(k + 1) : ray_.middleOf(k); }
  float depthAt(float place) const { return static_cast<float>(inputs_.lattice.first) + place * ray_.step; }
  /// The scalar at a place, as a position in the transfer table.
  double positionAt(float place, const Block& block) const {
    return inputs_.table.positionOf(interpolate(block, worldAt(place), inputs_.settings.interpolation));
  }
  /// The colour of a place where the block has values for it; else the given one.
  glm::vec3 colorAt(float place, const Block& block, const glm::vec3& color) const {
    if (block.colors.empty()) return color;
    const auto valueOf = [&](const Block& values) {
      return interpolate(values, worldAt(place), inputs_.settings.interpolation);
    };
    if (block.colors.size() == 1) return inputs_.function.colorAt(valueOf(block.colors[0]));
    glm::dvec3 rgb;
    for (int c = 0; c < 3; ++c) {
      const Block& values = block.colors[static_cast<std::size_t>(c)];
      rgb[c] = (valueOf(values) - values.displayed.x) / (values.displayed.y - values.displayed.x);
    }
    return glm::clamp(rgb, 0.0, 1.0);
  }
  glm::vec3 lightOn(float place, const Block& block) const {
    return lightAt(inputs_.settings, inputs_.view, block, worldAt(place), ray_.direction);
  }
  /// The shares of sample k before the faces between voxels, ascending, and 1.
  std::vector<float> facesIn(std::uint32_t k, const Block& block) const {
    const auto voxelAt = [&](float place) { return (worldAt(place) - block.origin) / block.spacing + 0.5; };
    const glm::dvec3 begin = voxelAt(beginOf(k));
    const glm::dvec3 end = voxelAt(endOf(k));
    std::vector<float> shares{1.0F};
    for (int axis = 0; axis < 3; ++axis) {
      const double last = std::max(begin[axis], end[axis]);
      for (double face = std::floor(std::min(begin[axis], end[axis])) + 1.0; face < last; face += 1.0)
        shares.push_back(static_cast<float>((face - begin[axis]) / (end[axis] - begin[axis])));
    }
    std::ranges::sort(shares);
    return shares;
  }
  float middleOf(std::uint32_t k) const { return ray_.middleOf(k); }
  float lengthPerDepth() const { return glm::length(ray_.direction); }

 private:
  /// The start of sample k: samples at the scene's faces are shorter or longer, as far as blocks have values.
  float placeOf(std::uint32_t k) const {
    const auto front = static_cast<float>(inputs_.lattice.first);
    const glm::vec3 size = glm::abs(ray_.direction);
    const float reach = std::max(inputs_.reach / std::max({size.x, size.y, size.z}), 0.5F);
    if (k == scene_.samples.first)
      return std::max((scene_.enter - front) / ray_.step, ray_.middleOf(k) - reach);
    if (k == scene_.samples.last)
      return std::min((scene_.leave - front) / ray_.step, ray_.middleOf(k) - 1.0F + reach);
    return static_cast<float>(k);
  }
  glm::dvec3 worldAt(float place) const { return glm::dvec3(ray_.at(place)) + inputs_.scene.bounds.center(); }

  const RayInputs& inputs_;
  SceneRay ray_;
  SceneStretch scene_;
  std::vector<OwnedSamples> owned_;
};

/// A sample's premultiplied colour, and its optical depth.
struct Material {
  glm::vec3 color{0.0F};
  float opticalDepth = 0.0F;
};

/// Material of the scalars from one place to another over a length of depth, with the light at `middle`.
Material materialBetween(const RayInputs& inputs, const SampledRay& ray, const Block& block, float from,
                         float to, float middle, float length) {
  const float slabsPerDepth =
      ray.lengthPerDepth() / static_cast<float>(inputs.table.unitDistance) / inputs.slabTable.length;
  const Slab slab = inputs.slabTable.between(ray.positionAt(from, block), ray.positionAt(to, block));
  const float opticalDepth = std::min(slab.opticalDepth * slabsPerDepth * length, maxExtinction);
  glm::vec3 color = ray.colorAt(middle, block, slab.color) * opacityOf(opticalDepth);
  if (inputs.settings.shading.on && opticalDepth > 0.0F) color *= ray.lightOn(middle, block);
  return {color, opticalDepth};
}

Material slabMaterial(const RayInputs& inputs, const SampledRay& ray, std::uint32_t k, const Block& block,
                      float length) {
  return materialBetween(inputs, ray, block, ray.beginOf(k), ray.endOf(k), ray.middleOf(k), length);
}

/// A sample of nearest values: the faces between voxels cut it into parts, each of one scalar.
Material nearestMaterial(const RayInputs& inputs, const SampledRay& ray, std::uint32_t k, const Block& block,
                         float length) {
  Material sum;
  float from = 0.0F;
  for (const float to : ray.facesIn(k, block)) {
    const float middle = glm::mix(ray.beginOf(k), ray.endOf(k), 0.5F * (from + to));
    const Material part = materialBetween(inputs, ray, block, middle, middle, middle, (to - from) * length);
    sum.color += (1.0F - opacityOf(sum.opticalDepth)) * part.color;
    sum.opticalDepth = std::min(sum.opticalDepth + part.opticalDepth, maxExtinction);
    from = to;
  }
  return sum;
}

Material isosurfaceMaterial(const RayInputs& inputs, const SampledRay& ray, std::uint32_t k,
                            const Block& block) {
  const float begin = ray.beginOf(k);
  const float end = ray.endOf(k);
  const glm::vec4 seen = crossed(inputs.isosurfaces, ray.positionAt(begin, block), ray.positionAt(end, block),
                                 [&](double share) {
                                   if (!inputs.settings.shading.on) return glm::vec3(1.0F);
                                   return ray.lightOn(glm::mix(begin, end, static_cast<float>(share)), block);
                                 });
  return {glm::vec3(seen), opticalDepthOf(seen.a)};
}

}  // namespace

std::vector<Interval> castRay(const RayInputs& inputs, std::span<const Block> blocks, int x, int y,
                              std::uint32_t atOnce) {
  const SampledRay ray(inputs, blocks, x, y);
  const float enough = terminationOpticalDepth(inputs.settings);
  const auto volumeMaterial =
      inputs.settings.interpolation == Interpolation::Nearest ? nearestMaterial : slabMaterial;
  const bool isosurfaces = inputs.settings.blending.mode == BlendMode::Isosurface;
  std::vector<Interval> samples;
  float total = 0.0F;
  for (const SampledRay::OwnedSamples& owned : ray.owned()) {
    const std::uint32_t first = (owned.range.first + atOnce - 1) / atOnce * atOnce;
    for (std::uint32_t k = first; k < owned.range.last; k += atOnce) {
      const float front = ray.frontOf(k);
      const float back = ray.backOf(std::min(k + atOnce, ray.inScene().last));
      const Material material = isosurfaces ? isosurfaceMaterial(inputs, ray, k, *owned.block)
                                            : volumeMaterial(inputs, ray, k, *owned.block, back - front);
      const glm::vec3& color = material.color;
      samples.push_back({front, back, color.r, color.g, color.b, material.opticalDepth});
      total += material.opticalDepth;
      if (total >= enough) return samples;
    }
  }
  return samples;
}

std::optional<Projection::Extreme> projectRay(const RayInputs& inputs, std::span<const Block> blocks, int x,
                                              int y) {
  const SampledRay ray(inputs, blocks, x, y);
  Projection projection(inputs.settings.blending.mode);
  for (const SampledRay::OwnedSamples& owned : ray.owned()) {
    for (std::uint32_t k = owned.range.first; k < owned.range.last; ++k) {
      for (const float place : {ray.beginOf(k), ray.endOf(k)})
        projection.add(ray.positionAt(place, *owned.block), ray.depthAt(place));
    }
  }
  return projection.extreme();
}

namespace {

void renderRay(const RayInputs& inputs, std::span<const Block> blocks, int x, int y, glm::vec4& rgba,
               float& depth) {
  if (inputs.settings.blending.projects()) {
    const auto extreme = projectRay(inputs, blocks, x, y);
    if (!extreme) return;
    rgba = inputs.table.materialAt(extreme->position);
    if (rgba.a > 0.0F) depth = extreme->depth;
    return;
  }
  Accumulator sum;
  for (const Interval& sample : castRay(inputs, blocks, x, y)) {
    sum.add({sample.red, sample.green, sample.blue}, opacityOf(sample.opticalDepth), sample.front);
  }
  rgba = sum.rgba();
  depth = sum.depth();
}

}  // namespace

Image renderVolume(const RayInputs& inputs, std::span<const Block> blocks) {
  Image image = blankImage(inputs.view.width(), inputs.view.height());
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const auto pixel =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x);
      renderRay(inputs, blocks, x, y, image.rgba[pixel], image.depth[pixel]);
    }
  }
  return image;
}

namespace {

constexpr int stride = countedStride;

/// The counted lists around a list along an axis: before and after it; the last one if none follows.
int countedBefore(int i) {
  return i - i % stride;
}
int countedBehind(int i, int size) {
  const int next = countedBefore(i + stride - 1);
  return next < size ? next : countedBefore(i);
}

}  // namespace

SupersegmentLists generate(const RayInputs& inputs, std::span<const Block> blocks, bool cutAtGaps) {
  SegmentRules rules{inputs.settings.supersegments, static_cast<float>(inputs.lattice.step), cutAtGaps};
  const int width = inputs.view.width();
  const int height = inputs.view.height();
  SupersegmentLists lists;
  const std::uint32_t atOnce = countedSamplesFor(inputs.lattice.count, rules.budget);
  // A rank's own lists get N_S each: a list's need is known only when all ranks' parts of it are together.
  if (inputs.settings.budget == Budget::Total && !cutAtGaps) {
    SupersegmentHistogram histogram;
    for (int y = 0; y < height; y += stride) {
      for (int x = 0; x < width; x += stride)
        addTo(histogram, castRay(inputs, blocks, x, y, atOnce), rules, atOnce);
    }
    rules.level = histogram.levelFor(inputs.settings.fill);
  }
  const auto listToleranceAt = [&](int x, int y) {
    return listToleranceOf(castRay(inputs, blocks, x, y, atOnce), rules, atOnce);
  };
  const auto listAt = [&](int x, int y) {
    const std::vector<Interval> samples = castRay(inputs, blocks, x, y);
    if (inputs.settings.algorithm == Algorithm::Bisection) return segmentByBisection(samples, rules);
    if (cutAtGaps) return segmentByMerging(samples, rules);
    const int left = countedBefore(x);
    const int right = countedBehind(x, width);
    const int below = countedBefore(y);
    const int above = countedBehind(y, height);
    SegmentRules own = rules;
    own.rounding = roundingOf(static_cast<std::uint32_t>(y * width + x));
    const ListTolerance counted[] = {listToleranceAt(left, below), listToleranceAt(right, below),
                                     listToleranceAt(left, above), listToleranceAt(right, above)};
    return segmentByMerging(samples, own, interpolatedTolerance(counted));
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

std::vector<SupersegmentLists> generateTogether(const RayInputs& inputs,
                                                std::span<const std::vector<Block>> ranks) {
  const std::uint32_t budget = maxPerList(inputs.settings.supersegments, inputs.settings.budget);
  const SegmentRules rules{budget, static_cast<float>(inputs.lattice.step), true};
  const std::uint32_t atOnce = countedSamplesFor(inputs.lattice.count, inputs.settings.supersegments);
  const int width = inputs.view.width();
  const int height = inputs.view.height();
  const int countedWidth = (width + stride - 1) / stride;
  const int countedHeight = (height + stride - 1) / stride;
  std::vector<std::vector<ListTolerance>> agreed(ranks.size());  // tolerances of each rank's counted lists
  for (int y = 0; y < countedHeight; ++y) {
    for (int x = 0; x < countedWidth; ++x) {
      std::vector<CountedLevels> levels;
      CountedLevels sum;
      for (const std::vector<Block>& blocks : ranks) {
        levels.push_back(
            countedLevels(castRay(inputs, blocks, x * stride, y * stride, atOnce), rules, atOnce));
        sum.shift = levels.back().shift;
        sum += levels.back();
      }
      for (std::size_t r = 0; r < ranks.size(); ++r)
        agreed[r].push_back(agreedTolerance(levels[r], sum, budget));
    }
  }
  std::vector<SupersegmentLists> result(ranks.size());
  for (std::size_t r = 0; r < ranks.size(); ++r) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const auto at = [&](int column, int row) {
          const int counted = row / stride * countedWidth + column / stride;
          return agreed[r][static_cast<std::size_t>(counted)];
        };
        const int left = countedBefore(x);
        const int right = countedBehind(x, width);
        const int below = countedBefore(y);
        const int above = countedBehind(y, height);
        const ListTolerance counted[] = {at(left, below), at(right, below), at(left, above),
                                         at(right, above)};
        const auto list =
            segmentByMerging(castRay(inputs, ranks[r], x, y), rules, agreedToleranceBetween(counted, budget));
        result[r].segments.insert(result[r].segments.end(), list.begin(), list.end());
        result[r].offsets.push_back(static_cast<std::uint32_t>(result[r].segments.size()));
      }
    }
  }
  return result;
}

namespace {

/// All ranks' supersegments of a list, by depth.
std::vector<Interval> interleavedList(std::span<const SupersegmentLists> subLists, std::size_t list) {
  std::vector<Interval> interleaved;
  for (const SupersegmentLists& sub : subLists) {
    for (const Supersegment& s : sub.list(list))
      interleaved.push_back({s.front, s.back, s.red, s.green, s.blue, opticalDepthOf(s.opacity)});
  }
  std::stable_sort(interleaved.begin(), interleaved.end(),
                   [](const Interval& a, const Interval& b) { return a.front < b.front; });
  return interleaved;
}

}  // namespace

SupersegmentLists composite(std::span<const SupersegmentLists> subLists, const GenerateSettings& settings,
                            double sampleStep) {
  SegmentRules rules{settings.supersegments, static_cast<float>(sampleStep), false};
  const std::size_t listCount = subLists.empty() ? 0 : subLists.front().listCount();
  if (settings.budget == Budget::Total) {
    SupersegmentHistogram histogram;
    for (std::size_t i = 0; i < listCount; ++i) addTo(histogram, interleavedList(subLists, i), rules);
    rules.level = histogram.levelFor(settings.fill);
  }
  SupersegmentLists result;
  for (std::size_t i = 0; i < listCount; ++i) {
    rules.rounding = roundingOf(static_cast<std::uint32_t>(i));
    const auto list = segment(interleavedList(subLists, i), rules, settings.algorithm);
    result.segments.insert(result.segments.end(), list.begin(), list.end());
    result.offsets.push_back(static_cast<std::uint32_t>(result.segments.size()));
  }
  return result;
}

}  // namespace vdi::reference
