#include "vdi/core/ComponentValues.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <memory>
#include <span>

namespace vdi {

namespace {

bool isWide(ComponentType type) {
  return type == ComponentType::I64 || type == ComponentType::U64;
}

ScalarType scalarTypeOf(ComponentType type) {
  assert(!isWide(type));
  return static_cast<ScalarType>(type);
}

template <typename T>
double load(const void* data, std::size_t index) {
  T value{};
  std::memcpy(&value, static_cast<const std::byte*>(data) + index * sizeof value, sizeof value);
  return static_cast<double>(value);
}

/// Computes magnitudes, phases and 64-bit components as doubles, a tile at a time.
class Computation : public ComputedValues {
 public:
  Computation(const ComponentArray& array, int component) : array_(array), component_(component) {}

  void read(const IndexBox& box, void* to) const override {
    const Tiling tiles(box, fastestAxis(array_.strides));
    const ByteStrides strides = packedStrides(box.size(), sizeof(double));
    for (std::size_t i = 0; i < tiles.count(); ++i) {
      const IndexBox tile = tiles[i];
      std::array<double, Tiling::values> results;
      compute(tile, std::span(results).first(tile.count()));
      copyStrided(results.data(), packedStrides(tile.size(), sizeof(double)),
                  static_cast<std::byte*>(to) + offsetOf(tile.lo - box.lo, strides), strides, tile.size(),
                  sizeof(double));
    }
  }

 private:
  /// Calls visit(index, value) for component `c` of the tile's values.
  template <typename Visit>
  void forEach(const IndexBox& tile, int c, Visit visit) const {
    TileBuffer buffer;
    const std::size_t bytes = sizeOf(array_.type);
    copyStrided(array_.first + offsetOf(tile.lo, array_.strides) + c * array_.componentStride, array_.strides,
                buffer.bytes.data(), packedStrides(tile.size(), bytes), tile.size(), bytes);
    for (std::size_t i = 0; i < tile.count(); ++i)
      visit(i, loadComponent(array_.type, buffer.bytes.data(), i));
  }

  void compute(const IndexBox& tile, std::span<double> results) const {
    if (component_ == phase) {
      forEach(tile, 0, [&](std::size_t i, double real) { results[i] = real; });
      forEach(tile, 1, [&](std::size_t i, double value) { results[i] = std::atan2(value, results[i]); });
    } else if (component_ == magnitude && array_.components > 1) {
      std::fill(results.begin(), results.end(), 0.0);
      for (int c = 0; c < array_.components; ++c)
        forEach(tile, c, [&](std::size_t i, double value) { results[i] += value * value; });
      for (double& result : results) result = std::sqrt(result);
    } else {
      forEach(tile, std::max(component_, 0), [&](std::size_t i, double value) { results[i] = value; });
    }
  }

  ComponentArray array_;
  int component_;
};

}  // namespace

std::size_t sizeOf(ComponentType type) {
  return isWide(type) ? sizeof(std::uint64_t) : sizeOf(scalarTypeOf(type));
}

double loadComponent(ComponentType type, const void* data, std::size_t index) {
  switch (type) {
    case ComponentType::U8:
      return load<std::uint8_t>(data, index);
    case ComponentType::I8:
      return load<std::int8_t>(data, index);
    case ComponentType::U16:
      return load<std::uint16_t>(data, index);
    case ComponentType::I16:
      return load<std::int16_t>(data, index);
    case ComponentType::U32:
      return load<std::uint32_t>(data, index);
    case ComponentType::I32:
      return load<std::int32_t>(data, index);
    case ComponentType::F32:
      return load<float>(data, index);
    case ComponentType::F64:
      return load<double>(data, index);
    case ComponentType::I64:
      return load<std::int64_t>(data, index);
    case ComponentType::U64:
      return load<std::uint64_t>(data, index);
  }
  return 0.0;
}

void showComponent(Block& block, const ComponentArray& array, int component) {
  assert(component < array.components && (component != phase || array.components == 2));
  const bool isOne = component >= 0 || (component == magnitude && array.components == 1);
  const std::byte* const first = array.first + std::max(component, 0) * array.componentStride;
  block.data = first;
  block.strides.reset();
  block.computed = nullptr;
  if (isOne && !isWide(array.type)) {
    block.type = scalarTypeOf(array.type);
    block.setStrides(array.strides);
    return;
  }
  block.type = ScalarType::F64;
  block.computed = std::make_shared<Computation>(array, component);
}

}  // namespace vdi
