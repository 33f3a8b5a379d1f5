#include "vdi/core/Vdi.h"

#include <fmt/format.h>

#include <cmath>

#include "vdi/core/Error.h"

namespace vdi {

namespace {

[[noreturn]] void fail(const std::string& what) {
  throw Error(ErrorCode::Format, "not a sound VDI: " + what);
}

/// Negated comparisons, so that NaN fails.
bool wellFormed(const Supersegment& segment, float previousBack) {
  const bool depths =
      segment.front >= previousBack && segment.front < segment.back && std::isfinite(segment.back);
  const bool color =
      std::isfinite(segment.red) && std::isfinite(segment.green) && std::isfinite(segment.blue);
  return depths && color && segment.opacity > 0.0F && segment.opacity <= 1.0F;
}

/// What offsets say, whatever the supersegments are.
void validateOffsets(const Vdi& vdi) {
  const std::size_t lists = static_cast<std::size_t>(vdi.width) * static_cast<std::size_t>(vdi.height);
  const auto& offsets = vdi.offsets();
  if (offsets.size() != lists + 1) fail(fmt::format("{} offsets for {} lists", offsets.size(), lists));
  if (offsets.front() != 0 || offsets.back() != vdi.supersegmentCount()) {
    fail(fmt::format("the offsets end at {}, there are {} supersegments", offsets.back(),
                     vdi.supersegmentCount()));
  }
  for (std::size_t i = 0; i < lists; ++i) {
    if (offsets[i + 1] < offsets[i] || offsets[i + 1] - offsets[i] > vdi.budget) {
      fail(fmt::format("list {} runs from {} to {} with a budget of {}", i, offsets[i], offsets[i + 1],
                       vdi.budget));
    }
  }
}

void validateSegments(const SupersegmentLists& lists) {
  for (std::size_t i = 0; i < lists.listCount(); ++i) {
    float previousBack = 0.0F;
    for (const Supersegment& segment : lists.list(i)) {
      if (!wellFormed(segment, previousBack)) {
        fail(fmt::format("list {} has a supersegment from depth {} to {} with opacity {}", i, segment.front,
                         segment.back, segment.opacity));
      }
      previousBack = segment.back;
    }
  }
}

void validateSegments(const CompactLists& lists) {
  for (std::size_t i = 0; i < lists.listCount(); ++i) {
    std::uint32_t previousBack = 0;
    for (const CompactSupersegment& segment : lists.list(i)) {
      if (segment.front() < previousBack || segment.front() >= segment.back()) {
        fail(fmt::format("list {} has a supersegment from depth code {} to {}, one before it ends at {}", i,
                         segment.front(), segment.back(), previousBack));
      }
      previousBack = segment.back();
    }
  }
}

}  // namespace

Supersegment Vdi::supersegment(std::size_t index) const {
  if (const auto* compact = std::get_if<CompactLists>(&lists)) {
    return expanded(compact->segments[index], depthCode);
  }
  return std::get<SupersegmentLists>(lists).segments[index];
}

SupersegmentLists Vdi::expandedLists() const {
  if (const auto* compact = std::get_if<CompactLists>(&lists)) return expanded(*compact, depthCode);
  return std::get<SupersegmentLists>(lists);
}

void validate(const Vdi& vdi) {
  if (vdi.width < 1 || vdi.height < 1) fail(fmt::format("{} x {} lists", vdi.width, vdi.height));
  const bool compact = vdi.precision() == Precision::Compact;
  const DepthCode& code = vdi.depthCode;
  const bool usable = code.step > 0.0F && code.first >= 0.0F &&
                      std::isfinite(code.depthOf(DepthCode::largest)) &&
                      code.depthOf(DepthCode::largest) > code.depthOf(DepthCode::largest - 1);
  if (compact ? !usable : code != DepthCode{}) {
    fail(fmt::format("{} supersegments with depths from {} in steps of {}", toString(vdi.precision()),
                     code.first, code.step));
  }
  validateOffsets(vdi);
  std::visit([](const auto& lists) { validateSegments(lists); }, vdi.lists);
}

}  // namespace vdi
