#include "vdi/core/Block.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <mutex>
#include <span>
#include <type_traits>
#include <utility>

#include "vdi/core/Error.h"
#include "vdi/core/Finite.h"
#include "vdi/core/Parallel.h"

namespace vdi {

namespace {

constexpr std::array<std::pair<const char*, std::size_t>, 8> scalarTypes{
    {{"u8", 1}, {"i8", 1}, {"u16", 2}, {"i16", 2}, {"u32", 4}, {"i32", 4}, {"f32", 4}, {"f64", 8}}};

/// These loops are written so that compilers vectorise them. They run for every value of every step; a loop
/// with a branch and one pair of bounds would take several times as long as the upload.
template <typename T>
class Extremes {
 public:
  Extremes() {
    minimum_.fill(Limits::max());
    maximum_.fill(Limits::lowest());
  }
  void include(std::span<const T> values) {
    // A comparison with NaN is false, so only infinite values need more care, and they are rare.
    constexpr std::size_t many = 8192;  // fit the cache, if they must be read again
    for (; values.size() > many; values = values.subspan(many)) includeAtOnce(values.first(many));
    includeAtOnce(values);
  }
  ScalarRange range() const {
    const T low = *std::min_element(minimum_.begin(), minimum_.end());
    const T high = *std::max_element(maximum_.begin(), maximum_.end());
    if (high < low) return {};  // no finite value
    return {static_cast<double>(low), static_cast<double>(high)};
  }

 private:
  using Limits = std::numeric_limits<T>;
  static constexpr std::size_t lanes = 64 / sizeof(T);
  using Lanes = std::array<T, lanes>;

  void includeAtOnce(std::span<const T> values) {
    Lanes minimum = minimum_;
    Lanes maximum = maximum_;
    const auto each = [values](auto take) {
      std::size_t i = 0;
      for (; i + lanes <= values.size(); i += lanes) {
        for (std::size_t lane = 0; lane < lanes; ++lane) take(lane, values[i + lane]);
      }
      for (; i < values.size(); ++i) take(0, values[i]);
    };
    each([&](std::size_t lane, T value) {
      minimum[lane] = value < minimum[lane] ? value : minimum[lane];
      maximum[lane] = value > maximum[lane] ? value : maximum[lane];
    });
    if constexpr (std::is_floating_point_v<T>) {
      const auto isInfinite = [](T value) { return std::isinf(value); };
      if (std::ranges::any_of(minimum, isInfinite) || std::ranges::any_of(maximum, isInfinite)) {
        minimum = minimum_;
        maximum = maximum_;
        each([&](std::size_t lane, T value) {
          const bool finite = std::abs(value) <= Limits::max();
          const T low = finite ? value : Limits::max();
          const T high = finite ? value : Limits::lowest();
          minimum[lane] = low < minimum[lane] ? low : minimum[lane];
          maximum[lane] = high > maximum[lane] ? high : maximum[lane];
        });
      }
    }
    minimum_ = minimum;
    maximum_ = maximum;
  }

  Lanes minimum_;
  Lanes maximum_;
};

}  // namespace

std::size_t sizeOf(ScalarType type) {
  return scalarTypes[static_cast<std::size_t>(type)].second;
}

const char* toString(ScalarType type) {
  return scalarTypes[static_cast<std::size_t>(type)].first;
}

ScalarType scalarTypeFromString(const std::string& name) {
  for (std::size_t i = 0; i < scalarTypes.size(); ++i) {
    if (name == scalarTypes[i].first) return static_cast<ScalarType>(i);
  }
  throw Error(ErrorCode::InvalidArgument,
              "no scalar type '" + name + "'; use u8, i8, u16, i16, u32, i32, f32 or f64");
}

Block Block::fromPoints(const glm::ivec3& dims, const glm::dvec3& origin, const glm::dvec3& spacing,
                        ScalarType type, const void* data, const GhostLayers& ghosts) {
  const Box owned{origin + spacing * glm::dvec3(ghosts.lo),
                  origin + spacing * glm::dvec3(dims - 1 - ghosts.hi)};
  return {dims, origin, spacing, owned, type, data};
}

Block Block::fromCells(const glm::ivec3& dims, const glm::dvec3& origin, const glm::dvec3& spacing,
                       ScalarType type, const void* data, const GhostLayers& ghosts) {
  const Box owned{origin + spacing * glm::dvec3(ghosts.lo), origin + spacing * glm::dvec3(dims - ghosts.hi)};
  return {dims, origin + 0.5 * spacing, spacing, owned, type, data};
}

double loadValue(ScalarType type, const void* data, std::size_t index) {
  return withTyped(type, data, [index](const auto* values) { return static_cast<double>(values[index]); });
}

void storeValue(ScalarType type, void* data, std::size_t index, double value) {
  withTyped(type, data, [&](auto* values) {
    using T = std::remove_pointer_t<decltype(values)>;
    if constexpr (std::is_integral_v<T>) {
      constexpr double low = static_cast<double>(std::numeric_limits<T>::lowest());
      constexpr double high = static_cast<double>(std::numeric_limits<T>::max());
      values[index] = std::isnan(value) ? T{0} : static_cast<T>(std::clamp(std::round(value), low, high));
    } else {
      values[index] = static_cast<T>(value);
    }
  });
}

std::vector<IndexBox> Block::ownBoxes() const {
  if (ownValues) return ownValues->boxes;
  std::vector<IndexBox> boxes{valuesIn(owned)};
  if (!masked) return boxes;
  for (const IndexBox& box : *masked) subtract(boxes, box);
  return boxes;
}

IndexBox Block::valuesIn(const Box& box) const {
  constexpr double tolerance = 0.01;  // in spacings: more than rounding moves a face
  const glm::dvec3 first = origin - offset * spacing;
  const glm::dvec3 most(dims);
  const glm::dvec3 lo = glm::ceil((box.lo - first) / spacing - tolerance);
  const glm::dvec3 hi = glm::floor((box.hi - first) / spacing + tolerance) + 1.0;
  return {glm::ivec3(glm::clamp(lo, glm::dvec3(0.0), most)),
          glm::ivec3(glm::clamp(hi, glm::dvec3(0.0), most))};
}

void Block::moveValues(const glm::dvec3& spacings) {
  offset += spacings;
  origin += spacings * spacing;
}

void Block::setStrides(const ByteStrides& bytes) {
  const bool aligned = reinterpret_cast<std::uintptr_t>(data) % sizeOf(type) == 0;
  strides.reset();
  if (!aligned || !arePacked(bytes, dims, sizeOf(type))) strides = bytes;
}

Block Block::withColors(std::size_t index) const {
  const Block& values = colors[index];
  Block block = *this;
  block.type = values.type;
  block.data = values.data;
  block.strides = values.strides;
  block.computed = values.computed;
  block.displayed = values.displayed;
  if (values.keepAlive) block.keepAlive = values.keepAlive;
  block.colors.clear();
  return block;
}

void Block::copyTo(const IndexBox& box, void* to) const {
  if (!computed) return copyTo(box, to, packedStrides(box.size(), sizeOf(type)));
  assert(!box.empty() && box == box.intersection(stored()));
  computed->read(box, to);
}

void Block::copyTo(const IndexBox& box, void* to, const ByteStrides& apart) const {
  assert(!box.empty() && box == box.intersection(stored()));
  const std::size_t bytes = sizeOf(type);
  if (!computed) {
    const ByteStrides from = strides.value_or(packedStrides(dims, bytes));
    return copyStrided(static_cast<const std::byte*>(data) + offsetOf(box.lo, from), from, to, apart,
                       box.size(), bytes);
  }
  const Tiling tiles = tilesOf(box);
  TileBuffer buffer;
  for (std::size_t i = 0; i < tiles.count(); ++i) {
    const IndexBox tile = tiles[i];
    computed->read(tile, buffer.bytes.data());
    copyStrided(buffer.bytes.data(), packedStrides(tile.size(), bytes),
                static_cast<std::byte*>(to) + offsetOf(tile.lo - box.lo, apart), apart, tile.size(), bytes);
  }
}

void Patch::copyTo(ScalarType type, const IndexBox& part, void* to, const ByteStrides& strides) const {
  if (!values) return donor->copyTo({part.lo + shift, part.hi + shift}, to, strides);
  const std::size_t bytes = sizeOf(type);
  copyStrided(static_cast<const std::byte*>(values.get()) + box.position(part.lo) * bytes,
              packedStrides(box.size(), bytes), to, strides, part.size(), bytes);
}

Tiling Block::tilesOf(const IndexBox& box) const {
  return {box, strides ? fastestAxis(*strides) : 0};
}

double storedValueAt(const Block& block, const glm::ivec3& at) {
  if (block.isPacked()) return loadValue(block.type, block.data, block.stored().position(at));
  alignas(double) std::array<std::byte, sizeof(double)> value{};
  block.copyTo({at, at + 1}, value.data());
  return loadValue(block.type, value.data(), 0);
}

double valueAt(const Block& block, int i, int j, int k) {
  const glm::ivec3 at{i, j, k};
  assert(block.extended().contains(at));
  const std::span<const Patch> patches = block.patchList();
  for (auto patch = patches.rbegin(); patch != patches.rend(); ++patch) {
    if (!patch->box.contains(at)) continue;
    if (!patch->values) return storedValueAt(*patch->donor, at + patch->shift);
    return loadValue(block.type, patch->values.get(), patch->box.position(at));
  }
  return storedValueAt(block, at);
}

void ScalarRange::include(const ScalarRange& other) {
  min = std::min(min, other.min);
  max = std::max(max, other.max);
}

namespace {

/// Calls `include` with spans that make up the stored values of a tile. Gathers them if they aren't packed.
template <typename T, typename Include>
void forEachSpan(const Block& block, const IndexBox& tile, TileBuffer& buffer, Include include) {
  if (!block.isPacked()) {
    block.copyTo(tile, buffer.bytes.data());
    return include(std::span(reinterpret_cast<const T*>(buffer.bytes.data()), tile.count()));
  }
  const auto* values = static_cast<const T*>(block.data);
  const bool wholeRows = tile.size().x == block.dims.x;  // those of a slice follow each other
  const int rows = wholeRows ? tile.size().y : 1;
  const auto length = static_cast<std::size_t>(tile.size().x) * static_cast<std::size_t>(rows);
  for (int z = tile.lo.z; z < tile.hi.z; ++z) {
    for (int y = tile.lo.y; y < tile.hi.y; y += rows)
      include(std::span(values + block.stored().position({tile.lo.x, y, z}), length));
  }
}

/// The range of the finite stored values in a box.
ScalarRange finiteRangeIn(const Block& block, const IndexBox& box) {
  const Tiling tiles = block.tilesOf(box);
  constexpr std::size_t minimum = 128;
  std::mutex mutex;
  ScalarRange range;
  inParallel(tiles.count(), minimum, [&](std::size_t first, std::size_t last) {
    withTyped(block.type, block.data, [&](const auto* typed) {
      using T = std::remove_cvref_t<decltype(*typed)>;
      TileBuffer buffer;
      Extremes<T> extremes;
      for (std::size_t i = first; i < last; ++i)
        forEachSpan<T>(block, tiles[i], buffer, [&](std::span<const T> values) { extremes.include(values); });
      const std::lock_guard lock(mutex);
      range.include(extremes.range());
    });
  });
  return range;
}

ScalarRange finiteRangeOf(ScalarType type, const Patch& patch) {
  if (!patch.values)
    return finiteRangeIn(*patch.donor, {patch.box.lo + patch.shift, patch.box.hi + patch.shift});
  return withTyped(type, patch.values.get(), [&patch](const auto* values) {
    Extremes<std::remove_cvref_t<decltype(*values)>> extremes;
    extremes.include(std::span(values, patch.box.count()));
    return extremes.range();
  });
}

}  // namespace

FiniteRanges finiteRanges(const Block& block, std::span<const IndexBox> own) {
  FiniteRanges ranges;
  for (const IndexBox& box : own) ranges.own.include(finiteRangeIn(block, box));
  ranges.used = ranges.own;
  for (const Patch& patch : block.patchList()) ranges.used.include(finiteRangeOf(block.type, patch));
  const IndexBox stored = block.stored();
  std::vector<IndexBox> others{block.ownValues ? block.ownValues->used.intersection(stored) : stored};
  for (const IndexBox& box : own) subtract(others, box);
  for (const Patch& patch : block.patchList()) subtract(others, patch.box);
  for (const IndexBox& box : others) ranges.used.include(finiteRangeIn(block, box));
  return ranges;
}

ScalarRange ownRange(const Block& block) {
  ScalarRange range;
  for (const IndexBox& box : block.ownBoxes()) range.include(finiteRangeIn(block, box));
  return range;
}

ValueLimits limitsOf(ScalarType type) {
  if (type == ScalarType::F32) return {1e-30, std::numeric_limits<double>::infinity()};
  if (type == ScalarType::F64) return {1e-300, 1e300};
  return {};
}

ValueSizes valueSizesOf(std::span<const Block> blocks) {
  ValueSizes sizes;
  for (const Block& block : blocks) {
    const double minimum = limitsOf(block.type).minimum;
    const Tiling tiles = block.tilesOf(block.stored());
    TileBuffer buffer;
    for (std::size_t i = 0; i < tiles.count() && !sizes.usable; ++i) {
      const IndexBox tile = tiles[i];
      block.copyTo(tile, buffer.bytes.data());
      withTyped(block.type, static_cast<const void*>(buffer.bytes.data()), [&](const auto* values) {
        using T = std::remove_cvref_t<decltype(*values)>;
        if constexpr (!std::is_floating_point_v<T>) {
          sizes.usable = true;
        } else {
          bool usable = false;
          bool tooSmall = false;
          for (const T value : std::span(values, tile.count())) {
            const T size = std::abs(value);
            usable |= size >= static_cast<T>(minimum) && size <= std::numeric_limits<T>::max();
            tooSmall |= size > T{0} && size < static_cast<T>(minimum);
          }
          sizes.usable |= usable;
          sizes.tooSmall |= tooSmall;
        }
      });
    }
    if (sizes.usable) break;
  }
  return sizes;
}

void validate(std::span<const Block> blocks) {
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const Block& block = blocks[i];
    const std::string context = fmt::format("block {}", i);
    if (glm::any(glm::lessThan(block.dims, glm::ivec3(1)))) {
      throw Error(ErrorCode::InvalidArgument,
                  fmt::format("a block needs at least one value per axis, but has {} x {} x {}", block.dims.x,
                              block.dims.y, block.dims.z),
                  context);
    }
    // These bounds leave headroom for computations in single precision.
    constexpr double minSpacing = 1e-30;
    constexpr double maxSpacing = 1e30;
    if (!isFinite(block.spacing) || glm::any(glm::lessThan(block.spacing, glm::dvec3(minSpacing))) ||
        glm::any(glm::greaterThan(block.spacing, glm::dvec3(maxSpacing)))) {
      const bool isSpacing =
          isFinite(block.spacing) && glm::all(glm::greaterThan(block.spacing, glm::dvec3(0.0)));
      throw Error(ErrorCode::InvalidArgument,
                  fmt::format("spacing must be {}, but is ({}, {}, {}){}",
                              isSpacing ? fmt::format("from {} to {}", minSpacing, maxSpacing)
                                        : std::string("finite and above 0"),
                              block.spacing.x, block.spacing.y, block.spacing.z,
                              isSpacing ? "; use other units of length" : ""),
                  context);
    }
    const bool ownsNothing = block.owned.empty();
    if (!isFinite(block.origin) ||
        (!ownsNothing && (!isFinite(block.owned.lo) || !isFinite(block.owned.hi)))) {
      throw Error(ErrorCode::InvalidArgument, "origin and owned box must be finite", context);
    }
    constexpr double farthest = 1e12;
    glm::dvec3 away = glm::abs(block.origin);
    if (!ownsNothing) away = glm::max(away, glm::max(glm::abs(block.owned.lo), glm::abs(block.owned.hi)));
    if (glm::any(glm::greaterThan(away, farthest * block.spacing))) {
      throw Error(
          ErrorCode::InvalidArgument,
          fmt::format(
              "it lies at ({}, {}, {}) with a spacing of ({}, {}, {}); positions more than {} spacings from "
              "the origin of the world can't be told apart; choose an origin near the data",
              block.origin.x, block.origin.y, block.origin.z, block.spacing.x, block.spacing.y,
              block.spacing.z, farthest),
          context);
    }
    if (block.data == nullptr) throw Error(ErrorCode::InvalidArgument, "a block has no data", context);
    assert(!block.strides || !block.computed);
  }
}

}  // namespace vdi
