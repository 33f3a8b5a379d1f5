#include "vdi/reference/Compaction.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

namespace vdi::reference {

namespace {

using shared::maxCarriedDepth;
using shared::maxColorChange;
using shared::maxDepthChange;
using shared::thinnestStep;
using shared::unseen;
static_assert(shared::maxDepthCode == static_cast<float>(DepthCode::largest));

std::uint32_t codeOfOpticalDepth(float opticalDepth) {
  const float code = std::log2(1.0F + 16.0F * std::max(opticalDepth, 0.0F)) * (4095.0F / 16.0F);
  return static_cast<std::uint32_t>(std::clamp(std::round(code), 0.0F, 4095.0F));
}

std::uint32_t codeOfDepth(float depth, const DepthCode& code) {
  const float place = std::round((depth - code.first) / code.step);
  return static_cast<std::uint32_t>(std::clamp(place, 0.0F, static_cast<float>(DepthCode::largest)));
}

class Compactor {
 public:
  explicit Compactor(const DepthCode& code) : code_(code) {}

  CompactSupersegment add(const Interval& s) {
    const std::uint32_t front =
        std::min(std::max(codeOfDepth(s.front, code_), reach_), DepthCode::largest - 1);
    const std::uint32_t back = std::max(codeOfDepth(s.back, code_), front + 1);
    reach_ = back;

    const float own = s.opticalDepth;
    const float slack = maxDepthChange * own + thinnestStep;
    const std::uint32_t depth = codeOfOpticalDepth(own + std::clamp(carriedDepth_, -slack, slack));
    const float stored = opticalDepthOfCode(depth);

    const glm::vec3 light = std::exp2(-depth_) * glm::vec3(s.red, s.green, s.blue);
    const float seen = std::exp2(-storedDepth_) * opacityOf(stored);
    const glm::vec3 straight = glm::vec3(s.red, s.green, s.blue) / opacityOf(own);
    glm::vec3 color = straight;
    if (seen > unseen) {
      color =
          glm::clamp((carriedLight_ + light) / seen, straight - maxColorChange, straight + maxColorChange);
    }
    const glm::vec3 codes = glm::round(glm::clamp(color, 0.0F, 1.0F) * 255.0F);

    carriedLight_ += light - seen / 255.0F * codes;
    carriedDepth_ = std::clamp(carriedDepth_ + own - stored, -maxCarriedDepth, maxCarriedDepth);
    depth_ += own;
    storedDepth_ += stored;
    return CompactSupersegment::pack(front, back, static_cast<std::uint32_t>(codes.r),
                                     static_cast<std::uint32_t>(codes.g), static_cast<std::uint32_t>(codes.b),
                                     depth);
  }

 private:
  DepthCode code_;
  std::uint32_t reach_ = 0;
  float depth_ = 0.0F;        // optical depth so far
  float storedDepth_ = 0.0F;  // optical depth of the stored supersegments
  float carriedDepth_ = 0.0F;
  glm::vec3 carriedLight_{0.0F};
};

}  // namespace

std::vector<CompactSupersegment> compacted(std::span<const Interval> list, const DepthCode& code) {
  std::vector<CompactSupersegment> result;
  result.reserve(list.size());
  Compactor compactor(code);
  for (const Interval& s : list) result.push_back(compactor.add(s));
  return result;
}

CompactLists compacted(const SupersegmentLists& lists, const DepthCode& code) {
  CompactLists result;
  result.offsets = lists.offsets;
  std::vector<Interval> intervals;
  for (std::size_t i = 0; i < lists.listCount(); ++i) {
    intervals.clear();
    for (const Supersegment& s : lists.list(i)) {
      intervals.push_back({s.front, s.back, s.red, s.green, s.blue, opticalDepthOf(s.opacity)});
    }
    const auto list = compacted(intervals, code);
    result.segments.insert(result.segments.end(), list.begin(), list.end());
  }
  return result;
}

}  // namespace vdi::reference
