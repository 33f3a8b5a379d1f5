#include "vdi/core/ComponentValues.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace vdi {

namespace {

bool isWide(ComponentType type) {
  return type == ComponentType::I64 || type == ComponentType::U64;
}

ScalarType scalarTypeOf(ComponentType type) {
  assert(!isWide(type));
  return static_cast<ScalarType>(type);
}

/// Calls `visit` with a zero of the type.
template <typename Visit>
auto withZero(ComponentType type, Visit visit) {
  if (type == ComponentType::I64) return visit(std::int64_t{});
  if (type == ComponentType::U64) return visit(std::uint64_t{});
  return withTyped(scalarTypeOf(type), static_cast<const void*>(nullptr),
                   [&]<typename T>(const T* /*none*/) { return visit(T{}); });
}

/// The missing numbers that components of the type can equal, as doubles that equal them exactly.
std::vector<double> occurringIn(ComponentType type, std::span<const double> missing) {
  return withZero(type, [&]<typename T>(T /*zero*/) {
    using Limits = std::numeric_limits<T>;
    std::vector<double> occurring;
    for (const double number : missing) {
      if (std::isinf(number) && std::is_floating_point_v<T>) occurring.push_back(number);
      // As a double, the largest 64-bit integer is rounded up by 1, and that is what a component becomes too.
      if (!(number >= static_cast<double>(Limits::lowest()) && number <= static_cast<double>(Limits::max())))
        continue;
      if constexpr (std::is_floating_point_v<T>) {
        occurring.push_back(static_cast<double>(static_cast<T>(number)));
      } else if (number == std::trunc(number)) {
        occurring.push_back(number);
      }
    }
    return occurring;
  });
}

/// Whether floats hold all values of the type.
bool fitsFloats(ComponentType type) {
  return type == ComponentType::F32 || sizeOf(type) < sizeof(float);
}

/// Computes magnitudes, phases, 64-bit components and those with missing values, a tile at a time.
class Computation : public ComputedValues {
 public:
  /// `type` is F32 or F64.
  Computation(const ComponentArray& array, int component, ScalarType type)
      : array_(array), component_(component), type_(type) {
    array_.missing = occurringIn(array.type, array.missing);
  }

  void read(const IndexBox& box, void* to) const override {
    const Tiling tiles(box, fastestAxis(array_.strides));
    const std::size_t bytes = sizeOf(type_);
    const ByteStrides strides = packedStrides(box.size(), bytes);
    for (std::size_t i = 0; i < tiles.count(); ++i) {
      const IndexBox tile = tiles[i];
      Values results;
      compute(tile, std::span(results).first(tile.count()));
      std::array<float, Tiling::values> narrow;
      const void* from = results.data();
      if (type_ == ScalarType::F32) {
        std::transform(results.begin(), results.begin() + static_cast<std::ptrdiff_t>(tile.count()),
                       narrow.begin(), [](double value) { return static_cast<float>(value); });
        from = narrow.data();
      }
      copyStrided(from, packedStrides(tile.size(), bytes),
                  static_cast<std::byte*>(to) + offsetOf(tile.lo - box.lo, strides), strides, tile.size(),
                  bytes);
    }
  }

 private:
  using Values = std::array<double, Tiling::values>;

  /// Component `c` of the tile's values, NaN where it is missing.
  void load(const IndexBox& tile, int c, std::span<double> to) const {
    TileBuffer buffer;
    const std::size_t bytes = sizeOf(array_.type);
    copyStrided(array_.first + offsetOf(tile.lo, array_.strides) + c * array_.componentStride, array_.strides,
                buffer.bytes.data(), packedStrides(tile.size(), bytes), tile.size(), bytes);
    withZero(array_.type, [&]<typename T>(T /*zero*/) {
      const auto* values = reinterpret_cast<const T*>(buffer.bytes.data());
      std::transform(values, values + to.size(), to.begin(), [](T v) { return static_cast<double>(v); });
    });
    // Compilers vectorise this loop, one missing number at a time.
    for (const double missing : array_.missing) {
      for (double& value : to) value = value == missing ? std::numeric_limits<double>::quiet_NaN() : value;
    }
  }

  void compute(const IndexBox& tile, std::span<double> results) const {
    const bool isMagnitude = component_ == magnitude && array_.components > 1;
    load(tile, isMagnitude ? 0 : std::max(component_, 0), results);
    if (component_ != phase && !isMagnitude) return;
    Values others;
    const std::span<double> other = std::span(others).first(results.size());
    if (component_ == phase) {
      load(tile, 1, other);
      for (std::size_t i = 0; i < results.size(); ++i) results[i] = std::atan2(other[i], results[i]);
      return;
    }
    for (double& result : results) result *= result;
    for (int c = 1; c < array_.components; ++c) {
      load(tile, c, other);
      for (std::size_t i = 0; i < results.size(); ++i) results[i] += other[i] * other[i];
    }
    for (double& result : results) result = std::sqrt(result);
  }

  ComponentArray array_;
  int component_;
  ScalarType type_;
};

/// The value that is full red, green or blue.
double topOf(ComponentType type) {
  return withZero(type, []<typename T>(T /*zero*/) {
    return std::is_integral_v<T> ? static_cast<double>(std::numeric_limits<T>::max()) : 1.0;
  });
}

}  // namespace

std::size_t sizeOf(ComponentType type) {
  return isWide(type) ? sizeof(std::uint64_t) : sizeOf(scalarTypeOf(type));
}

std::string componentIssue(int component, int components) {
  if (components == 1 && component >= magnitude) return {};  // it has only that one to show
  if (component == phase && components != 2)
    return fmt::format("has {} components; a phase needs two, real and imaginary", components);
  if (component == together && components != 2 && components != 4)
    return fmt::format(
        "has {} components; to be used together, they must be two, colour and opacity, or four, "
        "red, green, blue and opacity",
        components);
  if (component < together || component >= components)
    return fmt::format("has {} components, so component {} doesn't exist", components, component);
  return {};
}

int legendComponent(int component, int components) {
  if (component != together) return component;
  return components == 2 ? 0 : components - 1;
}

void showComponent(Block& block, const ComponentArray& array, int component) {
  assert(componentIssue(component, array.components).empty());
  block.colors.clear();
  if (component == together) {
    const int opacity = array.components - 1;
    std::vector<Block> colors(static_cast<std::size_t>(opacity));
    for (int c = 0; c < opacity; ++c) {
      Block& color = colors[static_cast<std::size_t>(c)];
      showComponent(color, array, c);
      color.displayed = {0.0, topOf(array.type)};
    }
    showComponent(block, array, opacity);
    block.colors = std::move(colors);
    return;
  }
  const bool isOne = component >= 0 || (component == magnitude && array.components == 1);
  const std::byte* const first = array.first + std::max(component, 0) * array.componentStride;
  block.data = first;
  block.strides.reset();
  block.computed = nullptr;
  const bool areComplete = occurringIn(array.type, array.missing).empty();
  if (isOne && !isWide(array.type) && areComplete) {
    block.type = scalarTypeOf(array.type);
    block.setStrides(array.strides);
    return;
  }
  block.type = isOne && fitsFloats(array.type) ? ScalarType::F32 : ScalarType::F64;
  block.computed = std::make_shared<Computation>(array, component, block.type);
}

void leaveOutMissing(Block& block, std::span<const double> missing) {
  assert(!block.computed);
  const std::size_t bytes = sizeOf(block.type);
  ComponentArray array;
  array.first = static_cast<const std::byte*>(block.data);
  array.strides = block.strides.value_or(packedStrides(block.dims, bytes));
  array.type = static_cast<ComponentType>(block.type);
  array.missing.assign(missing.begin(), missing.end());
  showComponent(block, array, 0);
}

}  // namespace vdi
