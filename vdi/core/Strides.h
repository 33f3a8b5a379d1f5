// Values that lie at regular distances in memory, in any order.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <glm/glm.hpp>
#include <utility>

#include "vdi/core/Box.h"

namespace vdi {

/// The distances in bytes of neighbouring values along x, y and z. They may be 0 or negative, and need not be
/// multiples of a value's size.
using ByteStrides = glm::vec<3, std::int64_t>;

/// The strides of values [size.z][size.y][size.x], x fastest, without gaps.
inline ByteStrides packedStrides(const glm::ivec3& size, std::size_t valueBytes) {
  const auto x = static_cast<std::int64_t>(valueBytes);
  return {x, x * size.x, x * size.x * size.y};
}

/// Whether values with these strides are packed. The stride of an axis with one value is of no consequence.
inline bool arePacked(const ByteStrides& strides, const glm::ivec3& size, std::size_t valueBytes) {
  const ByteStrides packed = packedStrides(size, valueBytes);
  bool in = true;
  for (int axis = 0; axis < 3; ++axis) in = in && (size[axis] == 1 || strides[axis] == packed[axis]);
  return in;
}

/// The offset in bytes of the value `at` from value (0, 0, 0).
inline std::int64_t offsetOf(const glm::ivec3& at, const ByteStrides& strides) {
  return at.x * strides.x + at.y * strides.y + at.z * strides.z;
}

/// The axis along which neighbours are nearest to each other; x in a tie.
inline int fastestAxis(const ByteStrides& strides) {
  const ByteStrides size = glm::abs(strides);
  if (size.x <= size.y && size.x <= size.z) return 0;
  return size.y <= size.z ? 1 : 2;
}

/// Divides a box of values into tiles. A tile's gathered values stay in the core's own cache. A tile is long
/// along the axis of adjacent values, for fast reading, and has whole cache lines along x, for writing.
class Tiling {
 public:
  static constexpr int width = 16;     // along x if another axis is the fastest
  static constexpr int values = 4096;  // limit for one tile

  Tiling(const IndexBox& box, int fastest) : box_(box), tile_(1) {
    const glm::ivec3 size = box.size();
    tile_.x = std::clamp(size.x, 1, fastest == 0 ? values : width);
    if (fastest != 0) tile_[fastest] = std::clamp(size[fastest], 1, values / tile_.x);
    for (const int axis : {1, 2}) {
      if (axis != fastest)
        tile_[axis] = std::clamp(values / (tile_.x * tile_.y * tile_.z), 1, std::max(size[axis], 1));
    }
    count_ = glm::u64vec3((size + tile_ - 1) / tile_);
  }
  std::size_t count() const { return count_.x * count_.y * count_.z; }
  /// Tile `index`, in the indices of the box.
  IndexBox operator[](std::size_t index) const {
    const glm::ivec3 number(index % count_.x, index / count_.x % count_.y, index / (count_.x * count_.y));
    const glm::ivec3 lo = box_.lo + number * tile_;
    return {lo, glm::min(lo + tile_, box_.hi)};
  }

 private:
  IndexBox box_;
  glm::ivec3 tile_;
  glm::u64vec3 count_{0};
};

namespace detail {

/// The innermost loop follows the fastest axis of `from`, the next loop the faster of the others in `to`.
template <std::size_t bytes>
void copyTile(const std::byte* from, const ByteStrides& fromStrides, std::byte* to,
              const ByteStrides& toStrides, const glm::ivec3& size) {
  std::array<int, 3> order{0, 1, 2};
  const auto byStride = [](const ByteStrides& strides) {
    return [&strides](int a, int b) { return std::abs(strides[a]) < std::abs(strides[b]); };
  };
  std::stable_sort(order.begin(), order.end(), byStride(fromStrides));
  std::stable_sort(order.begin() + 1, order.end(), byStride(toStrides));
  const auto [a, b, c] = order;
  for (int k = 0; k < size[c]; ++k) {
    for (int j = 0; j < size[b]; ++j) {
      const std::byte* source = from + j * fromStrides[b] + k * fromStrides[c];
      std::byte* target = to + j * toStrides[b] + k * toStrides[c];
      for (int i = 0; i < size[a]; ++i)
        std::memcpy(target + i * toStrides[a], source + i * fromStrides[a], bytes);
    }
  }
}

template <std::size_t bytes>
void copyTiles(const std::byte* from, const ByteStrides& fromStrides, std::byte* to,
               const ByteStrides& toStrides, const glm::ivec3& size) {
  const Tiling tiling({glm::ivec3(0), size}, fastestAxis(fromStrides));
  for (std::size_t i = 0; i < tiling.count(); ++i) {
    const IndexBox tile = tiling[i];
    copyTile<bytes>(from + offsetOf(tile.lo, fromStrides), fromStrides, to + offsetOf(tile.lo, toStrides),
                    toStrides, tile.size());
  }
}

}  // namespace detail

/// Copies `size` values of 1, 2, 4 or 8 bytes each. The values that are written must not overlap.
inline void copyStrided(const void* from, const ByteStrides& fromStrides, void* to,
                        const ByteStrides& toStrides, const glm::ivec3& size, std::size_t valueBytes) {
  const auto* source = static_cast<const std::byte*>(from);
  auto* target = static_cast<std::byte*>(to);
  const auto bytes = static_cast<std::int64_t>(valueBytes);
  if (size.x == 1 || (fromStrides.x == bytes && toStrides.x == bytes)) {
    // Rows that follow each other on both sides are one long row, and so are slices of such rows.
    std::int64_t row = size.x * bytes;
    int rows = size.y;
    int slices = size.z;
    if (fromStrides.y == row && toStrides.y == row) {
      row *= std::exchange(rows, 1);
      if (fromStrides.z == row && toStrides.z == row) row *= std::exchange(slices, 1);
    }
    for (int z = 0; z < slices; ++z) {
      for (int y = 0; y < rows; ++y) {
        std::memcpy(target + y * toStrides.y + z * toStrides.z,
                    source + y * fromStrides.y + z * fromStrides.z, static_cast<std::size_t>(row));
      }
    }
    return;
  }
  switch (valueBytes) {
    case 1:
      return detail::copyTiles<1>(source, fromStrides, target, toStrides, size);
    case 2:
      return detail::copyTiles<2>(source, fromStrides, target, toStrides, size);
    case 4:
      return detail::copyTiles<4>(source, fromStrides, target, toStrides, size);
    default:
      return detail::copyTiles<8>(source, fromStrides, target, toStrides, size);
  }
}

}  // namespace vdi
