#include "vdi/reference/Segmenter.h"

#include <algorithm>
#include <cmath>

#include "vdi/core/TransferFunction.h"

namespace vdi::reference {

namespace {

/// The supersegment that is being filled.
class OpenSegment {
 public:
  explicit OpenSegment(const Interval& first)
      : front_(first.front),
        reach_(first.back),
        back_(first.back),
        color_{first.red, first.green, first.blue},
        opticalDepth_(first.opticalDepth) {}

  float reach() const { return reach_; }

  /// The left side of Eq. 1: the distance between the material of `next` and this segment's, each over one
  /// sample.
  float difference(const Interval& next, float sampleStep) const {
    const float length = reach_ - front_;
    const float mine = densityScale(opticalDepth_, length, sampleStep);
    const float other = densityScale(next.opticalDepth, next.back - next.front, sampleStep);
    const float red = color_[0] * mine - next.red * other;
    const float green = color_[1] * mine - next.green * other;
    const float blue = color_[2] * mine - next.blue * other;
    const float opacity = opacityOf(opticalDepth_ * sampleStep / length) -
                          opacityOf(next.opticalDepth * sampleStep / (next.back - next.front));
    return std::sqrt(red * red + green * green + blue * blue + opacity * opacity);
  }

  void absorb(const Interval& next) {
    reach_ = next.back;
    if (!(next.opticalDepth > 0.0F)) return;
    back_ = next.back;
    const float transmittance = 1.0F - opacityOf(opticalDepth_);
    color_[0] += transmittance * next.red;
    color_[1] += transmittance * next.green;
    color_[2] += transmittance * next.blue;
    opticalDepth_ = std::min(opticalDepth_ + next.opticalDepth, maxExtinction);
  }

  Supersegment closed() const {
    return {front_, back_, color_[0], color_[1], color_[2], opacityOf(opticalDepth_)};
  }

 private:
  /// Factor that turns a colour accumulated over `length` into that of one sample.
  static float densityScale(float opticalDepth, float length, float sampleStep) {
    const float opacity = opacityOf(opticalDepth);
    return opacity > 0.0F ? opacityOf(opticalDepth * sampleStep / length) / opacity : 0.0F;
  }

  float front_;
  float reach_;  // end of the last absorbed interval, transparent ones included
  float back_;   // end of the last visible interval
  float color_[3];
  float opticalDepth_;
};

}  // namespace

std::size_t countRuns(std::span<const Interval> intervals) {
  std::size_t runs = 0;
  float reach = -1.0F;
  bool visible = false;
  for (const Interval& interval : intervals) {
    if (interval.front > reach) visible = false;
    if (interval.opticalDepth > 0.0F && !visible) {
      ++runs;
      visible = true;
    }
    reach = interval.back;
  }
  return runs;
}

std::vector<Supersegment> segmentWithSensitivity(std::span<const Interval> intervals, float sensitivity,
                                                 const SegmentRules& rules) {
  std::vector<Supersegment> list;
  std::vector<OpenSegment> open;  // at most one
  const auto close = [&] {
    list.push_back(open.back().closed());
    open.clear();
  };
  for (const Interval& interval : intervals) {
    if (!open.empty() && interval.front > open.back().reach()) {
      const Interval gap{open.back().reach(), interval.front, 0.0F, 0.0F, 0.0F, 0.0F};
      if (rules.cutAtGaps || open.back().difference(gap, rules.sampleStep) > sensitivity) {
        close();
      } else {
        open.back().absorb(gap);
      }
    }
    if (!open.empty() && open.back().difference(interval, rules.sampleStep) > sensitivity) close();
    if (!open.empty()) {
      open.back().absorb(interval);
    } else if (interval.opticalDepth > 0.0F) {
      open.emplace_back(interval);
    }
  }
  if (!open.empty()) close();
  return list;
}

std::vector<Supersegment> segmentByBisection(std::span<const Interval> intervals, const SegmentRules& rules) {
  const std::size_t runs = rules.cutAtGaps ? countRuns(intervals) : 1;
  const std::size_t maxCount = std::max<std::size_t>(rules.budget, runs);
  const auto visible = std::count_if(intervals.begin(), intervals.end(),
                                     [](const Interval& interval) { return interval.opticalDepth > 0.0F; });
  if (static_cast<std::size_t>(visible) <= maxCount) return segmentWithSensitivity(intervals, -1.0F, rules);

  std::vector<Supersegment> best = segmentWithSensitivity(intervals, smallestSensitivity, rules);
  if (best.size() <= maxCount) return best;

  float tooFine = smallestSensitivity;
  float fits = largestSensitivity;
  best = segmentWithSensitivity(intervals, fits, rules);
  for (int i = 0; i < maxTries && fits > closeBounds * tooFine; ++i) {
    const float middle = std::sqrt(tooFine * fits);
    std::vector<Supersegment> list = segmentWithSensitivity(intervals, middle, rules);
    if (list.size() > maxCount) {
      tooFine = middle;
      continue;
    }
    fits = middle;
    best = std::move(list);
    if (static_cast<float>(best.size()) >= goodFill * static_cast<float>(maxCount)) break;
  }
  return best;
}

std::vector<Supersegment> segment(std::span<const Interval> intervals, const SegmentRules& rules,
                                  Algorithm algorithm) {
  switch (algorithm) {
    case Algorithm::Bisection:
      return segmentByBisection(intervals, rules);
    case Algorithm::Merge:
      break;
  }
  return segmentByMerging(intervals, rules);
}

}  // namespace vdi::reference
