// Bytes in memory that may be a GPU's, and what to copy of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace vdi::catalyst {

/// The bytes from `begin` on, wherever they lie.
struct MemoryRange {
  const std::byte* begin = nullptr;
  std::size_t bytes = 0;
  std::uintptr_t first() const { return reinterpret_cast<std::uintptr_t>(begin); }
};

/// Rows of bytes in memory of a device, and where they go on the host. Row (a, b, c, d) lies at `from` plus
/// the sum of each index times its stride. Strides are positive, and ascend.
struct RowCopy {
  const std::byte* from = nullptr;
  std::byte* to = nullptr;
  std::size_t rowBytes = 0;
  std::array<std::int64_t, 4> counts{1, 1, 1, 1};
  std::array<std::int64_t, 4> fromStrides{};
  std::array<std::int64_t, 4> toStrides{};

  /// The memory from the first byte of the first row to the last one of the last row.
  MemoryRange source() const {
    std::size_t bytes = rowBytes;
    for (std::size_t axis = 0; axis < counts.size(); ++axis)
      bytes += static_cast<std::size_t>((counts[axis] - 1) * fromStrides[axis]);
    return {from, bytes};
  }
};

}  // namespace vdi::catalyst
