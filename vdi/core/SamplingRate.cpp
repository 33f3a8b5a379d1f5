#include "vdi/core/SamplingRate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <numbers>
#include <utility>

#include "vdi/core/Parallel.h"
#include "vdi/core/SlabTable.h"

namespace vdi {

namespace {

constexpr std::size_t probeCount = 8192;

/// Bound on the sum of squared errors of a voxel's samples, weighted by the samples' opacity. With a larger
/// bound, the picture's SSIM to a converged one may fall below 0.997
/// (docs/adr/steep-functions-get-more-samples.md).
constexpr double tolerance = 1e-4;
/// Upper limit for the error of a sample, because a few large errors are less visible than many small ones.
constexpr double largestError = 0.05;

/// A point of an additive sequence that fills the unit cube evenly (M. Roberts, The Unreasonable
/// Effectiveness of Quasirandom Sequences, 2018), in five dimensions.
double coordinateOf(std::size_t index, std::size_t dimension) {
  constexpr double root = 1.1347241384015194;  // root of x^6 = x + 1
  constexpr std::array powers{root, root * root, root * root * root, root * root * root * root,
                              root * root * root * root * root};
  const double place = static_cast<double>(index + 1) / powers[dimension];
  return place - std::floor(place);
}

struct Place {
  glm::dvec3 center;  // relative to the scene's centre
  glm::dvec3 step;    // along the ray, one sample long at rate 1
};

Place placeOf(const Scene& scene, std::size_t index) {
  const glm::dvec3 share{coordinateOf(index, 0), coordinateOf(index, 1), coordinateOf(index, 2)};
  const double z = 2.0 * coordinateOf(index, 3) - 1.0;
  const double angle = 2.0 * std::numbers::pi * coordinateOf(index, 4);
  const double across = std::sqrt(1.0 - z * z);
  const glm::dvec3 direction{across * std::cos(angle), across * std::sin(angle), z};
  return {(share - 0.5) * scene.bounds.size(), scene.minSpacing * direction};
}

/// The trilinear value at a place, as in reference/Interpolation.cpp. Infinite values aren't replaced here:
/// they make the result infinite or NaN, and showsEnough leaves out such probes.
double interpolated(const Block& block, const glm::dvec3& world) {
  const IndexBox all = block.extended();
  const glm::dvec3 position =
      glm::clamp((world - block.origin) / block.spacing, glm::dvec3(all.lo), glm::dvec3(all.hi - 1));
  const glm::ivec3 base = glm::min(glm::ivec3(glm::floor(position)), glm::max(all.hi - 2, all.lo));
  const glm::dvec3 share = position - glm::dvec3(base);
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::ivec3 side{corner & 1, (corner >> 1) & 1, (corner >> 2) & 1};
    const glm::dvec3 weight = glm::mix(1.0 - share, share, glm::dvec3(side));
    const double product = weight.x * weight.y * weight.z;
    const glm::ivec3 at = glm::min(base + side, all.hi - 1);
    if (product > 0.0) sum += product * valueAt(block, at.x, at.y, at.z);
  }
  return sum;
}

/// The faces of a block's owned box by the rule for samples (snapToScene), which gives each place one owner.
struct SnappedBox {
  glm::vec3 lo{0.0F};
  glm::vec3 hi{0.0F};

  SnappedBox(const Scene& scene, const Box& owned) {
    for (int axis = 0; axis < 3; ++axis) {
      lo[axis] = snapToScene(scene, owned.lo[axis], axis);
      hi[axis] = snapToScene(scene, owned.hi[axis], axis);
    }
  }
  bool contains(const glm::vec3& center) const {
    return glm::all(glm::greaterThanEqual(center, lo)) && glm::all(glm::lessThan(center, hi));
  }
};

double nearest(const Block& block, const glm::dvec3& world) {
  const IndexBox all = block.extended();
  const glm::dvec3 position = glm::round((world - block.origin) / block.spacing);
  const glm::ivec3 at(glm::clamp(position, glm::dvec3(all.lo), glm::dvec3(all.hi - 1)));
  return valueAt(block, at.x, at.y, at.z);
}

Probe probeIn(const Scene& scene, const Block& block, std::size_t index, const Place& place) {
  Probe probe;
  probe.index = index;
  probe.value = nearest(block, scene.bounds.center() + place.center);
  for (std::size_t i = 0; i < Probe::offsets.size(); ++i) {
    const glm::dvec3 world = scene.bounds.center() + place.center + Probe::offsets[i] * place.step;
    probe.scalars[i] = interpolated(block, world);
  }
  return probe;
}

bool shows(const Region& region, const glm::dvec3& world) {
  if (region.box) {
    const glm::bvec3 below = glm::lessThan(world, region.box->lo);
    const glm::bvec3 above = glm::greaterThanEqual(world, region.box->hi);
    if (glm::any(below) || glm::any(above)) return false;
  }
  return std::ranges::all_of(region.planes, [&](const ClipPlane& plane) {
    return glm::dot(world - plane.origin, plane.normal) >= 0.0;
  });
}

std::vector<Probe> probesIn(const Region& region, const Scene& scene, std::span<const Probe> probes) {
  std::vector<Probe> shown;
  shown.reserve(probes.size());
  for (const Probe& probe : probes) {
    if (region == Region{} || shows(region, scene.bounds.center() + placeOf(scene, probe.index).center))
      shown.push_back(probe);
  }
  return shown;
}

/// Difference between one slab and its two halves.
struct SlabError {
  double squared = 0.0;
  double opacity = 0.0;
};

SlabError errorOf(const SlabIntegral& slabs, const std::array<double, 3>& positions, double length) {
  const glm::dvec4 whole = slabs.between(positions[0], positions[2], length);
  glm::dvec4 halves = slabs.between(positions[0], positions[1], 0.5 * length);
  halves += (1.0 - halves.a) * slabs.between(positions[1], positions[2], 0.5 * length);
  const glm::dvec4 off = glm::abs(whole - halves);
  const double largest = std::min(std::max({off.r, off.g, off.b, off.a}), largestError);
  return {largest * largest, halves.a};
}

/// Whether slabs show enough at this rate. Rate 1 tests whole probes, rate 2 the middle half of each probe.
bool showsEnough(const TransferTable& table, const SlabIntegral& slabs, double minSpacing,
                 std::span<const Probe> probes, double rate) {
  std::vector<SlabError> errors(probes.size());
  const std::size_t aside = rate < 2.0 ? 2 : 1;
  const double length = minSpacing / rate / table.unitDistance;
  inParallel(probes.size(), 256, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const auto isLost = [](double scalar) { return !std::isfinite(scalar); };
      if (std::ranges::any_of(probes[i].scalars, isLost)) continue;
      const std::array positions{table.positionOf(probes[i].scalars[2 - aside]),
                                 table.positionOf(probes[i].scalars[2]),
                                 table.positionOf(probes[i].scalars[2 + aside])};
      errors[i] = errorOf(slabs, positions, length);
    }
  });
  SlabError sum;
  for (const SlabError& error : errors) {
    sum.squared += error.squared;
    sum.opacity += error.opacity;
  }
  return rate * sum.squared <= tolerance * sum.opacity;
}

}  // namespace

std::vector<Probe> probesOf(const Scene& scene, std::span<const Block> blocks) {
  if (scene.bounds.empty() || !(scene.minSpacing > 0.0)) return {};
  // Sorted by x: a block searches only the places between its faces.
  std::vector<std::pair<Place, std::size_t>> places;
  places.reserve(probeCount);
  for (std::size_t index = 0; index < probeCount; ++index) places.emplace_back(placeOf(scene, index), index);
  const auto isBefore = [](const auto& a, const auto& b) { return a.first.center.x < b.first.center.x; };
  std::ranges::sort(places, isBefore);
  struct Owned {
    const Block* block;
    std::size_t index;
    Place place;
  };
  std::vector<Owned> owned;
  for (const Block& block : blocks) {
    if (block.owned.empty()) continue;
    // A margin wider than the distance by which snapping moves a face.
    const double spare = 1e-5 * scene.bounds.size().x;
    const auto at = [&](double x) {
      return std::pair(Place{glm::dvec3(x - scene.bounds.center().x, 0.0, 0.0), {}}, std::size_t{0});
    };
    const auto first = std::ranges::lower_bound(places, at(block.owned.lo.x - spare), isBefore);
    const auto last = std::ranges::upper_bound(places, at(block.owned.hi.x + spare), isBefore);
    const SnappedBox box(scene, block.owned);
    for (auto place = first; place < last; ++place) {
      if (box.contains(glm::vec3(place->first.center)))
        owned.push_back({&block, place->second, place->first});
    }
  }
  std::ranges::sort(owned, {}, &Owned::index);
  // Probes take time in each step of a simulation, regardless of the rate.
  std::vector<Probe> probes(owned.size());
  inParallel(owned.size(), 256, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i)
      probes[i] = probeIn(scene, *owned[i].block, owned[i].index, owned[i].place);
  });
  return probes;
}

double samplingRateFor(const TransferTable& table, const Scene& scene, const Region& region,
                       std::span<const Probe> probes) {
  const SlabIntegral slabs(table);
  const std::vector<Probe> shown = probesIn(region, scene, probes);
  for (const double rate : {1.0, 2.0}) {
    if (showsEnough(table, slabs, scene.minSpacing, shown, rate)) return rate;
  }
  return 4.0;
}

namespace {

/// The shortest part that `share` of the ascending values fill. There is at least one value.
ScalarRange shortestPart(std::span<const double> values, double share) {
  const auto most = static_cast<double>(values.size());
  const auto count = std::max<std::size_t>(1, static_cast<std::size_t>(std::ceil(share * most)));
  ScalarRange part{values.front(), values.back()};
  for (std::size_t i = 0; i + count <= values.size(); ++i) {
    if (values[i + count - 1] - values[i] < part.max - part.min) part = {values[i], values[i + count - 1]};
  }
  return part;
}

}  // namespace

std::optional<ScalarRange> crowdedPart(const ScalarRange& range, std::span<const Probe> probes) {
  constexpr double nearlyAll = 0.99;
  constexpr double least = 1.0 / 256.0;
  constexpr std::size_t fewest = 100;  // of fewer probes, one is more than 1 %
  const double length = range.max - range.min;
  std::vector<double> values;
  for (const Probe& probe : probes) {
    if (std::isfinite(probe.value)) values.push_back(probe.value);
  }
  std::ranges::sort(values);
  const auto isCrowded = [&](const ScalarRange& part) {
    return part.max > part.min && part.max - part.min < least * length;
  };
  const std::span<const double> all(values);
  const auto low = static_cast<std::size_t>(std::ranges::upper_bound(values, range.min) - values.begin());
  const auto high = static_cast<std::size_t>(std::ranges::lower_bound(values, range.max) - values.begin());
  for (const std::span<const double>& some : {all, all.subspan(low), all.first(high)}) {
    if (some.size() < fewest) continue;
    if (const ScalarRange part = shortestPart(some, nearlyAll); isCrowded(part)) return part;
  }
  return std::nullopt;
}

std::string describeCrowded(const ScalarRange& range, const ScalarRange& part) {
  return fmt::format(
      "the colours' automatic range is from {:.6g} to {:.6g}, but 99 % of the values that aren't at its ends "
      "fill less than 1/256 of it, from {:.6g} to {:.6g}; set the range, or name fill values as missing",
      range.min, range.max, part.min, part.max);
}

}  // namespace vdi
