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

/// Values along each axis that are copied before the next ones: where another axis is fastest, lines of the
/// cache are used up before they go.
constexpr std::int64_t tile = 16;

/// Of the values [x, xEnd) of a row.
template <std::size_t scalarBytes>
void copyRow(const StridedValues& values, std::int64_t x, std::int64_t xEnd, const std::byte* row,
             std::byte* to) {
  for (; x < xEnd; ++x) {
    for (int c = 0; c < values.components; ++c) {
      std::memcpy(to, row + x * values.strides[0] + c * values.componentStride, scalarBytes);
      to += scalarBytes;
    }
  }
}

template <std::size_t scalarBytes>
void copyAll(const StridedValues& values, std::byte* to) {
  const auto& [nx, ny, nz] = values.counts;
  const std::int64_t valueBytes = static_cast<std::int64_t>(scalarBytes) * values.components;
  for (std::int64_t firstZ = 0; firstZ < nz; firstZ += tile) {
    for (std::int64_t firstY = 0; firstY < ny; firstY += tile) {
      for (std::int64_t x = 0; x < nx; x += tile) {
        for (std::int64_t z = firstZ; z < std::min(firstZ + tile, nz); ++z) {
          for (std::int64_t y = firstY; y < std::min(firstY + tile, ny); ++y) {
            copyRow<scalarBytes>(values, x, std::min(x + tile, nx),
                                 values.first + y * values.strides[1] + z * values.strides[2],
                                 to + ((z * ny + y) * nx + x) * valueBytes);
          }
        }
      }
    }
  }
}

}  // namespace

bool StridedValues::inOrder() const {
  const auto scalar = static_cast<std::int64_t>(scalarBytes);
  std::int64_t next = scalar * components;
  bool in = components == 1 || componentStride == scalar;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    in = in && (counts[axis] == 1 || strides[axis] == next);
    next *= counts[axis];
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
  // Not VTK's own allocation: where that fails, Debian's VTK ends the process.
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
