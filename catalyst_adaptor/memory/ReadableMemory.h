// Whether the process can read its memory, before it tries.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "catalyst_adaptor/memory/RowCopy.h"

namespace vdi::catalyst {

/// The index of a range that the host can't read as a whole, such as freed or half-mapped memory, or a GPU's;
/// nullopt if it can read all. Reads /proc/self/maps once. Where that is missing, all counts as readable.
std::optional<std::size_t> firstUnreadable(const std::vector<MemoryRange>& ranges);

}  // namespace vdi::catalyst
