// The range of the default colour map.
#ifndef VDIDefaultRange_h
#define VDIDefaultRange_h

#include <optional>

#include "VDIBlocks.h"
#include "VDIVolume.h"
#include "vdi/core/ScalarRange.h"

namespace pv {

/// The range stays that of the first frame while the array stays the same, so that films don't flicker.
class DefaultRange {
 public:
  /// Call it before each frame with the frame's array.
  void noteChoice(const ArrayChoice& choice) {
    if (!(choice_ == choice)) first_.reset();
    choice_ = choice;
  }
  vdi::ScalarRange rangeOf(const Shown& shown) {
    this->noteChoice(shown.of.choice);
    if (first_) return *first_;
    const vdi::ScalarRange range = shown.range;
    if (range.min < range.max) return *(first_ = range);
    // Without values, or with one value everywhere, there is no range to keep.
    const double low = range.min <= range.max ? range.min : 0.0;
    return {low, low + 1.0};
  }

 private:
  std::optional<vdi::ScalarRange> first_;
  ArrayChoice choice_;
};

}  // namespace pv

#endif
