#include "catalyst_adaptor/StridedArray.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <limits>
#include <new>
#include <stdexcept>
#include <string>

namespace vdi::catalyst {

namespace {

/// The number of values along each axis that are copied as one tile. If another axis is fastest, a tile uses
/// up lines of the cache before they are evicted.
constexpr std::int64_t tile = 16;

/// Whether a row has no gaps, nor the components of its values.
bool rowInOrder(const StridedValues& values) {
  const auto scalar = static_cast<std::int64_t>(values.scalarBytes);
  return (values.components == 1 || values.componentStride == scalar) &&
         (values.counts[0] == 1 || values.strides[0] == scalar * values.components);
}

/// Copies `count` values of a row.
template <std::size_t scalarBytes>
void copyRow(const StridedValues& values, std::int64_t count, const std::byte* from, std::byte* to) {
  for (std::int64_t x = 0; x < count; ++x) {
    for (int c = 0; c < values.components; ++c) {
      std::memcpy(to, from + x * values.strides[0] + c * values.componentStride, scalarBytes);
      to += scalarBytes;
    }
  }
}

template <std::size_t scalarBytes>
void copyAll(const StridedValues& values, std::byte* to) {
  const std::int64_t nx = values.counts[0];
  const std::int64_t ny = values.counts[1];
  const std::int64_t nz = values.counts[2];
  const std::int64_t valueBytes = static_cast<std::int64_t>(scalarBytes) * values.components;
  const bool wholeRows = rowInOrder(values);
  const std::int64_t tileX = wholeRows ? nx : tile;
  const auto copy = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
    const std::byte* from =
        values.first + x * values.strides[0] + y * values.strides[1] + z * values.strides[2];
    std::byte* place = to + ((z * ny + y) * nx + x) * valueBytes;
    const std::int64_t count = std::min(tileX, nx - x);
    if (wholeRows) {
      std::memcpy(place, from, static_cast<std::size_t>(count * valueBytes));
    } else {
      copyRow<scalarBytes>(values, count, from, place);
    }
  };
  for (std::int64_t firstZ = 0; firstZ < nz; firstZ += tile) {
    for (std::int64_t firstY = 0; firstY < ny; firstY += tile) {
      for (std::int64_t x = 0; x < nx; x += tileX) {
        for (std::int64_t z = firstZ; z < std::min(firstZ + tile, nz); ++z) {
          for (std::int64_t y = firstY; y < std::min(firstY + tile, ny); ++y) copy(x, y, z);
        }
      }
    }
  }
}

}  // namespace

bool StridedValues::inOrder() const {
  std::int64_t next = static_cast<std::int64_t>(scalarBytes) * components;
  bool in = rowInOrder(*this);
  for (std::size_t axis = 1; axis < 3; ++axis) {
    next *= counts[axis - 1];
    in = in && (counts[axis] == 1 || strides[axis] == next);
  }
  return in;
}

bool StridedValues::reachable() const {
  std::int64_t lowest = 0;
  std::int64_t highest = 0;
  const auto add = [&](std::int64_t count, std::int64_t stride) {
    std::int64_t reach = 0;
    if (__builtin_mul_overflow(count - 1, stride, &reach)) return false;
    std::int64_t& end = reach < 0 ? lowest : highest;
    return !__builtin_add_overflow(end, reach, &end);
  };
  const auto address = reinterpret_cast<std::uintptr_t>(first);
  if (!add(counts[0], strides[0]) || !add(counts[1], strides[1]) || !add(counts[2], strides[2]) ||
      !add(components, componentStride))
    return false;
  const std::uintptr_t below = 0 - static_cast<std::uintptr_t>(lowest);
  const std::uintptr_t above = static_cast<std::uintptr_t>(highest) + scalarBytes;
  return below <= address && above <= std::numeric_limits<std::uintptr_t>::max() - address;
}

StridedArray::StridedArray(const StridedValues& values) : values_(values) {
  assert(values.reachable());
  const std::size_t bytes = static_cast<std::size_t>(values.scalars()) * values.scalarBytes;
  // VTK's own allocation won't do: when it fails, Debian's VTK ends the process.
  memory_.reset(new (std::nothrow) std::byte[bytes]);
  if (!memory_) throw std::runtime_error("no memory to gather an array: " + std::to_string(bytes) + " bytes");
}

void StridedArray::gather() {
  switch (values_.scalarBytes) {
    case 1:
      return copyAll<1>(values_, memory_.get());
    case 2:
      return copyAll<2>(values_, memory_.get());
    case 4:
      return copyAll<4>(values_, memory_.get());
    default:
      return copyAll<8>(values_, memory_.get());
  }
}

}  // namespace vdi::catalyst
