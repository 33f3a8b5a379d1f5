// Copies on the host of values that lie in a GPU's memory.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "catalyst_adaptor/StridedArray.h"
#include "catalyst_adaptor/memory/GpuMemory.h"
#include "vdi/core/Particles.h"

namespace vdi::catalyst {

/// The rows that hold some values, and the values' layout in a copy of these rows. Gaps between values are
/// copied where that is faster than leaving them out.
struct CopyPlan {
  RowCopy rows;            // `to` is null
  StridedValues copy;      // `first` is null
  std::int64_t first = 0;  // of value (0, 0, 0) in the copy, in bytes
  std::size_t bytes = 0;   // of the copy
};
CopyPlan planCopy(const StridedValues& values);

/// It plans copies, which `GpuMemory::copy` makes.
class HostCopy {
 public:
  /// Turns those of `values`, one entry for each block, whose indices are given into their copies.
  static std::shared_ptr<HostCopy> ofBlocks(std::vector<StridedValues>& values,
                                            std::span<const std::size_t> onDevice,
                                            const std::shared_ptr<HostCopy>& before);
  /// Turns these columns of `count` numbers into their copies. Columns that are interleaved in memory stay
  /// so.
  static std::shared_ptr<HostCopy> ofColumns(std::span<NumberColumn* const> columns, std::size_t count,
                                             const std::shared_ptr<HostCopy>& before);

  /// Adds the copies to make. `owner` is the name of the array, for messages, and outlives them.
  void addTo(std::vector<BufferCopy>& copies, std::string_view owner) const;

 private:
  struct Part {
    RowCopy rows;
    std::optional<std::size_t> block;
  };
  /// Memory for so many bytes: that of the copy that this one replaces, if it fits.
  void allocate(std::size_t bytes, const HostCopy* before);

  std::vector<Part> parts_;
  std::shared_ptr<HostBuffer> buffer_;
};

/// The memory of a column of numbers.
MemoryRange extentOf(const NumberColumn& column, std::size_t count);

}  // namespace vdi::catalyst
