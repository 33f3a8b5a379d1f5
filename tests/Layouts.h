// Blocks whose values lie in other orders than VTK's.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "vdi/core/Block.h"

namespace vdi::test {

struct Layout {
  const char* name = "";
  std::array<int, 3> axes{0, 1, 2};  // the fastest first
  std::array<int, 3> pads{0, 0, 0};  // values that are no part of the block, along each of these axes
  std::array<bool, 3> reversed{};    // x, y and z
  int stride = 1;                    // along the fastest axis, in values
  int shift = 0;                     // in bytes, of the first value
};

inline std::vector<Layout> layouts() {
  return {
      {.name = "packed"},
      {.name = "interleaved", .stride = 2},
      {.name = "padded", .pads = {3, 0, 0}},
      {.name = "inside of a halo", .pads = {4, 4, 0}},
      {.name = "z fastest", .axes = {2, 1, 0}},
      {.name = "y fastest, padded, interleaved", .axes = {1, 2, 0}, .pads = {1, 2, 0}, .stride = 3},
      {.name = "backwards", .reversed = {true, true, true}},
      {.name = "x backwards", .reversed = {true, false, false}},
      {.name = "unaligned", .shift = 1},
      {.name = "unaligned, z fastest", .axes = {2, 0, 1}, .shift = 3},
  };
}

inline Layout randomLayout(std::mt19937& random) {
  const auto upTo = [&random](int most) { return std::uniform_int_distribution<int>(0, most)(random); };
  Layout layout{.name = "random"};
  std::shuffle(layout.axes.begin(), layout.axes.end(), random);
  for (int& pad : layout.pads) pad = upTo(1) * upTo(5);
  for (bool& reversed : layout.reversed) reversed = upTo(1) == 1;
  layout.stride = 1 + upTo(2);
  layout.shift = upTo(2) == 0 ? upTo(7) : 0;
  return layout;
}

/// The block with its own copy of the values in this layout. All other bits of the copy are set, so that a
/// floating-point number read from there is NaN. The copy ends with its last value.
inline Block laidOut(const Block& block, const Layout& layout) {
  const auto bytes = static_cast<std::int64_t>(sizeOf(block.type));
  ByteStrides strides(0);
  std::int64_t next = bytes * layout.stride;
  for (std::size_t i = 0; i < 3; ++i) {
    const int axis = layout.axes[i];
    strides[axis] = next;
    next *= block.dims[axis] + layout.pads[i];
  }
  const std::int64_t size = layout.shift + offsetOf(block.dims - 1, strides) + bytes;
  std::int64_t first = layout.shift;
  for (int axis = 0; axis < 3; ++axis) {
    if (!layout.reversed[static_cast<std::size_t>(axis)]) continue;
    first += (block.dims[axis] - 1) * strides[axis];
    strides[axis] = -strides[axis];
  }
  const std::shared_ptr<std::byte[]> memory(new std::byte[static_cast<std::size_t>(size)]);
  std::memset(memory.get(), 0xFF, static_cast<std::size_t>(size));
  for (int z = 0; z < block.dims.z; ++z) {
    for (int y = 0; y < block.dims.y; ++y) {
      for (int x = 0; x < block.dims.x; ++x)
        block.copyTo({{x, y, z}, {x + 1, y + 1, z + 1}}, memory.get() + first + offsetOf({x, y, z}, strides));
    }
  }
  Block result = block;
  result.data = memory.get() + first;
  result.keepAlive = std::shared_ptr<const void>(memory, memory.get());
  result.computed = nullptr;
  result.setStrides(strides);
  return result;
}

}  // namespace vdi::test
