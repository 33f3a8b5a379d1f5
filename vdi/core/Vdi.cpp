#include "vdi/core/Vdi.h"

#include <fmt/format.h>

#include <cmath>

#include "vdi/core/Error.h"

namespace vdi {

namespace {

/// Negated comparisons, so that NaN fails.
bool wellFormed(const Supersegment& segment, float previousBack) {
  const bool depths =
      segment.front >= previousBack && segment.front < segment.back && std::isfinite(segment.back);
  const bool color =
      std::isfinite(segment.red) && std::isfinite(segment.green) && std::isfinite(segment.blue);
  return depths && color && segment.opacity > 0.0F && segment.opacity <= 1.0F;
}

}  // namespace

void validate(const Vdi& vdi) {
  const auto fail = [](const std::string& what) {
    throw Error(ErrorCode::Format, "not a sound VDI: " + what);
  };
  if (vdi.width < 1 || vdi.height < 1) fail(fmt::format("{} x {} lists", vdi.width, vdi.height));
  const std::size_t lists = static_cast<std::size_t>(vdi.width) * static_cast<std::size_t>(vdi.height);
  const auto& offsets = vdi.lists.offsets;
  if (offsets.size() != lists + 1) fail(fmt::format("{} offsets for {} lists", offsets.size(), lists));
  if (offsets.front() != 0 || offsets.back() != vdi.lists.segments.size()) {
    fail(fmt::format("the offsets end at {}, there are {} supersegments", offsets.back(),
                     vdi.lists.segments.size()));
  }
  for (std::size_t i = 0; i < lists; ++i) {
    if (offsets[i + 1] < offsets[i] || offsets[i + 1] - offsets[i] > vdi.budget) {
      fail(fmt::format("list {} runs from {} to {} with a budget of {}", i, offsets[i], offsets[i + 1],
                       vdi.budget));
    }
    float previousBack = 0.0F;
    for (const Supersegment& segment : vdi.lists.list(i)) {
      if (!wellFormed(segment, previousBack)) {
        fail(fmt::format("list {} has a supersegment from depth {} to {} with opacity {}", i, segment.front,
                         segment.back, segment.opacity));
      }
      previousBack = segment.back;
    }
  }
}

}  // namespace vdi
