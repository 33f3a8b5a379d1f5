#include "vdi/core/Vdi.h"

#include <fmt/format.h>

#include <cmath>
#include <span>

#include "vdi/core/Error.h"

namespace vdi {

namespace {

[[noreturn]] void fail(const std::string& what) {
  throw Error(ErrorCode::Format, "invalid VDI: " + what);
}

/// Uses negated comparisons, so that NaN fails.
bool wellFormed(const Supersegment& segment, float previousBack) {
  const bool depths =
      segment.front >= previousBack && segment.front < segment.back && std::isfinite(segment.back);
  const bool color =
      std::isfinite(segment.red) && std::isfinite(segment.green) && std::isfinite(segment.blue);
  return depths && color && segment.opacity > 0.0F && segment.opacity <= 1.0F;
}

/// `number` is the list's number in the VDI.
void validateList(std::span<const Supersegment> list, std::uint64_t number) {
  float previousBack = 0.0F;
  for (const Supersegment& segment : list) {
    if (!wellFormed(segment, previousBack)) {
      fail(fmt::format("list {} has a supersegment from depth {} to {} with opacity {}", number,
                       segment.front, segment.back, segment.opacity));
    }
    previousBack = segment.back;
  }
}

void validateList(std::span<const CompactSupersegment> list, std::uint64_t number) {
  std::uint32_t previousBack = 0;
  for (const CompactSupersegment& segment : list) {
    if (segment.front() < previousBack || segment.front() >= segment.back()) {
      fail(fmt::format("list {} has a supersegment from depth code {} to {}, but the previous one ends at {}",
                       number, segment.front(), segment.back(), previousBack));
    }
    previousBack = segment.back();
  }
}

}  // namespace

Supersegment Vdi::supersegment(std::size_t index) const {
  return std::visit([&](const auto& l) -> Supersegment { return expanded(l.segments[index], depthCode); },
                    lists);
}

SupersegmentLists Vdi::expandedLists() const {
  return std::visit([&](const auto& l) -> SupersegmentLists { return expanded(l, depthCode); }, lists);
}

void validateShape(const Vdi& vdi) {
  if (vdi.width < 1 || vdi.height < 1)
    fail(fmt::format("a VDI can't have {} x {} lists", vdi.width, vdi.height));
  // Does not double the margin, since large values would overflow.
  const auto leavesSome = [](int size, int margin) { return margin >= 0 && margin <= (size - 1) / 2; };
  if (!leavesSome(vdi.width, vdi.margin.x) || !leavesSome(vdi.height, vdi.margin.y)) {
    fail(fmt::format("a margin of {} x {} lists leaves no picture of {} x {}", vdi.margin.x, vdi.margin.y,
                     vdi.width, vdi.height));
  }
  const DepthCode& code = vdi.depthCode;
  const bool usable = code.exists() && code.first >= 0.0F &&
                      std::isfinite(code.depthOf(DepthCode::largest)) &&
                      code.depthOf(DepthCode::largest) > code.depthOf(DepthCode::largest - 1);
  if (hasDepthCode(vdi.precision()) ? !usable : code != DepthCode{}) {
    fail(fmt::format("{} supersegments with depths from {} in steps of {}", toString(vdi.precision()),
                     code.first, code.step));
  }
}

template <typename Segment>
void validateLists(const ListsOf<Segment>& lists, std::size_t first, std::size_t last,
                   std::uint64_t firstList, std::uint32_t budget) {
  const auto& offsets = lists.offsets;
  for (std::size_t i = first; i < last; ++i) {
    if (offsets[i + 1] < offsets[i] || offsets[i + 1] - offsets[i] > budget ||
        offsets[i + 1] > lists.segments.size()) {
      fail(fmt::format("list {} runs from {} to {} with a budget of {}", firstList + (i - first), offsets[i],
                       offsets[i + 1], budget));
    }
  }
  for (std::size_t i = first; i < last; ++i) validateList(lists.list(i), firstList + (i - first));
}

#define VDI_VALIDATE_LISTS(Segment)                                                             \
  template void validateLists(const ListsOf<Segment>&, std::size_t, std::size_t, std::uint64_t, \
                              std::uint32_t);
VDI_EACH_ENCODING(VDI_VALIDATE_LISTS)
#undef VDI_VALIDATE_LISTS

void validateEnds(const Vdi& vdi) {
  const std::size_t lists = static_cast<std::size_t>(vdi.width) * static_cast<std::size_t>(vdi.height);
  const auto& offsets = vdi.offsets();
  if (offsets.size() != lists + 1) fail(fmt::format("{} offsets for {} lists", offsets.size(), lists));
  if (offsets.front() != 0 || offsets.back() != vdi.supersegmentCount()) {
    fail(fmt::format("the offsets end at {}, but the VDI has {} supersegments", offsets.back(),
                     vdi.supersegmentCount()));
  }
}

void validate(const Vdi& vdi) {
  validateShape(vdi);
  validateEnds(vdi);
  std::visit([&](const auto& all) { validateLists(all, 0, all.listCount(), 0, vdi.budget); }, vdi.lists);
}

}  // namespace vdi
