// Values in the simulation's own order in memory, and copies of them in the order that VTK reads.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "catalyst_adaptor/memory/RowCopy.h"

namespace vdi::catalyst {

/// The values of one block: component c of value (x, y, z) lies at `first` + x * strides[0] + y * strides[1]
/// + z * strides[2] + c * componentStride, in bytes. Strides may be 0 or negative.
struct StridedValues {
  const std::byte* first = nullptr;
  std::array<std::int64_t, 3> counts{};  // number of values per axis, >= 1
  std::array<std::int64_t, 3> strides{};
  int components = 1;
  std::int64_t componentStride = 0;
  std::size_t scalarBytes = 1;  // 1, 2, 4 or 8

  std::int64_t scalars() const { return counts[0] * counts[1] * counts[2] * components; }
  /// Whether the values are an array in VTK's order: components side by side, x fastest, no gaps, aligned.
  bool inOrder() const;
  /// The memory from the first byte of a value to the last one; nullopt if some value's address is none.
  std::optional<MemoryRange> extent() const;
  bool reachable() const { return extent().has_value(); }
  std::size_t bytes() const { return static_cast<std::size_t>(scalars()) * scalarBytes; }
  /// Copies the values, as they are now, in VTK's order: `to` has room for `bytes()`.
  void copyTo(std::byte* to) const;
};

/// Memory that holds the values in VTK's order.
class StridedArray {
 public:
  /// Allocates the memory. Throws std::runtime_error if there is none. `values` must be reachable.
  explicit StridedArray(const StridedValues& values);

  /// Copies the values as they are now.
  void gather();
  /// The values, [z][y][x][component]. The address stays the same during this object's lifetime.
  void* data() { return memory_.get(); }

 private:
  StridedValues values_;
  std::unique_ptr<std::byte[]> memory_;
};

}  // namespace vdi::catalyst
