// VDIs with fewer lists, for views and networks that must be fast.
#pragma once

#include <cstdint>
#include <vector>

#include "vdi/core/Vdi.h"

namespace vdi {

/// Keeps about one list in `factor` of each row and of each column, unchanged; `factor` is at least 1. Views
/// of the result take less time on a CPU, and are as coarse as pictures with that many fewer pixels.
Vdi thinned(const Vdi& vdi, int factor);

/// The effect of thinned() on a VDI, without lists, for readers that do not have all of them at once.
struct Thinning {
  Vdi few;  // the thinned VDI, but for its lists; the depth code is that of the VDI given
  /// [few.height][few.width]: the index of the whole VDI's list that becomes this list, in ascending order;
  /// noList for a list that stays empty.
  std::vector<std::uint32_t> sources;
  static constexpr std::uint32_t noList = ~std::uint32_t{0};
};
/// Finds the thinning. It needs all of `vdi` but the lists.
Thinning thinningOf(const Vdi& vdi, int factor);

}  // namespace vdi
