// How the intervals along one ray become supersegments: the exchangeable piece of generation and compositing.
// Generation feeds it samples, compositing feeds it sub-supersegments; both are intervals of constant colour
// (paper, section 5.2). The constants are in shaders/shared/segmenting.h. The shaders' twin is
// shaders/segmenter.glsl and shaders/search.glsl.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "shaders/shared/segmenting.h"
#include "vdi/core/Budget.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/core/Vdi.h"

namespace vdi::reference {

/// A sample or sub-supersegment. Depth interval, premultiplied accumulated colour, and optical depth
/// -log2(1 - opacity) over the whole interval, which adds up where opacities multiply.
struct Interval {
  float front = 0.0F;
  float back = 0.0F;
  float red = 0.0F;
  float green = 0.0F;
  float blue = 0.0F;
  float opticalDepth = 0.0F;  // >= 0; 0: transparent
};

struct SegmentRules {
  std::uint32_t budget = 1;  // N_S
  float sampleStep = 1.0F;   // DepthLattice::step: the length that Eq. 1 is normalised to
  /// True for a sub-VDI that other ranks' supersegments will be merged with: a supersegment then never spans
  /// a gap, for another rank's material may lie there. False: a gap is a transparent sample, as in the paper.
  bool cutAtGaps = false;
  /// Of a SupersegmentHistogram: each list holds what it needs at that level, up to twice the budget
  /// (Budget::Total), by merging. Negative: each may hold `budget`. Not with cutAtGaps.
  float level = -1.0F;
  float rounding = 0.5F;  // with a level: roundingOf the list
};

/// Segments for one sensitivity (Eq. 1). Two sides are compared by their premultiplied colour *and* opacity,
/// both normalised to the length of one sample; the opacity is in because dark material would otherwise equal
/// empty space.
///   * A transparent interval never opens a supersegment. An open one absorbs it if Eq. 1 allows; a
///   transparent tail is
///     trimmed when the supersegment closes.
///   * A negative sensitivity cuts at every interval.
std::vector<Supersegment> segmentWithSensitivity(std::span<const Interval> intervals, float sensitivity,
                                                 const SegmentRules& rules);

/// The pieces of visible material that gaps force apart.
std::size_t countRuns(std::span<const Interval> intervals);

/// The sensitivity search, per list:
///   * the list may hold max(budget, runs) supersegments, runs being the pieces that gaps force (1 without
///   cutAtGaps);
///   * if no more intervals than that aren't transparent, each becomes a supersegment of its own: nothing is
///   lost;
///   * else the first try is smallestSensitivity, accepted if it fits;
///   * else bisection of the exponent between it and largestSensitivity, which always fits, until a try fills
///   at least
///     85 % of what the list may hold, or the bounds are closer than a factor of 1.001, or after 22 tries.
///     The smallest sensitivity that was seen to fit wins.
using shared::closeBounds;
using shared::goodFill;
using shared::largestSensitivity;
using shared::maxTries;
using shared::smallestSensitivity;
std::vector<Supersegment> segmentByBisection(std::span<const Interval> intervals, const SegmentRules& rules);

/// The default: no search for a sensitivity, and nothing that depends on one threshold for the whole list.
///   1. If no more intervals than the list may hold (see above) aren't transparent, each becomes a
///   supersegment.
///   2. Pre-segments: neighbouring intervals go together as long as their deviation from the pre-segment's
///   first one, summed over their length and weighted by how much of it V_O sees, stays within a tolerance:
///   sum of w * |x - x_first| * length / sampleStep, x being colour and opacity over one sample, w =
///   hiddenWeight + (1 - hiddenWeight) * transmittance in front. The tolerance is the smallest of
///   finestTolerance * toleranceRatio^j, j = 0 .. toleranceLevels - 1, that gives at most
///   preSegmentsPerBudget * budget pre-segments (or the number of runs, if that's larger); if none does, it's
///   infinite. As in segmentWithSensitivity, a transparent interval opens none, and a transparent tail is
///   trimmed.
///   3. While there are more pre-segments than the list may hold: a round of merging neighbours. The cost of
///   merging two is the sum over both, and over the empty space between them, of w * |x - x_mean| * length.
///   Front to back, two are merged if that costs no more than the limit, and no more than merging either of
///   them with its other neighbour (of equal costs those at even places count as less), until no more have to
///   go. The limit is the mean of all costs; after the
///   first round, of those of the mergers that the round before left out, as they were in it. (As good as
///   always merging the cheapest two, measured, and it has no list that's searched again for each.)
/// The tolerances are counted side by side in one pass along the ray, so that a device needs two passes in
/// all (Budget::Total takes one more, for its SupersegmentHistogram); and where no gaps must be kept, only
/// one ray of countedStride x countedStride is counted, see ListTolerance.
using shared::finestTolerance;
using shared::hiddenWeight;
using shared::preSegmentsPerBudget;
using shared::toleranceLevels;
using shared::toleranceRatio;

/// What step 2 may do for a list: its tolerance, and the pre-segments that counting found. There's room for a
/// few more; when fewer than sparePreSegments of that are left, the tolerance grows by toleranceRatio with
/// each further pre-segment, and the last one takes all that's left. So a list that wasn't counted can't
/// overflow, however wrong its interpolated tolerance is. Runs aren't bounded by that: a device that finds
/// more of them than it has room for writes the list again.
struct ListTolerance {
  float tolerance = -1.0F;  // negative: each interval is a pre-segment
  std::uint32_t preSegments = 0;
  std::uint32_t room = 0;  // >= pre-segments + sparePreSegments, or 0 for a list that's known to be empty
  /// With other ranks, see agreedTolerance: how many supersegments the list may become, but for runs, and how
  /// many runs are expected. Pre-segments that begin a run take no room. 0: the rules' budget.
  std::uint32_t quota = 0;
  std::uint32_t runs = 0;
  bool operator==(const ListTolerance&) const = default;
};
using shared::countedSamplesFor;
using shared::countedStride;
using shared::sparePreSegments;
using shared::uncountedSparePreSegments;

/// Counts. `atOnce`: samples that an interval stands for.
ListTolerance listToleranceOf(std::span<const Interval> intervals, const SegmentRules& rules,
                              std::size_t atOnce = 1);
/// Of a list among counted ones: the geometric mean of their tolerances, room for the most pre-segments.
/// Those that hold nothing have no say.
ListTolerance interpolatedTolerance(std::span<const ListTolerance> counted);

/// What a rank has in a counted list, in a form that ranks add up: visible samples, pre-segments at each
/// tolerance, runs. Each is divided by 2^shift, rounded up, and ends at 255, and so do sums.
struct CountedLevels {
  std::array<std::uint8_t, toleranceLevels + 2> counts{};
  std::uint32_t shift = 0;
  CountedLevels& operator+=(const CountedLevels& other);
};
/// The smallest at which it still shows whether there are more than preSegmentsPerBudget * budget
/// pre-segments.
std::uint32_t levelShiftFor(std::uint32_t budget);
CountedLevels countedLevels(std::span<const Interval> intervals, const SegmentRules& rules,
                            std::size_t atOnce);
/// One tolerance for what all ranks have in a list: the finest at which the sum of their pre-segments is at
/// most preSegmentsPerBudget * budget. Of the supersegments that come of the sum, a rank gets as large a
/// share as it has of the pre-segments. So all ranks together send about as much as one would make. The
/// tolerance is 0 where nobody has anything.
ListTolerance agreedTolerance(const CountedLevels& own, const CountedLevels& sum, std::uint32_t budget);
/// Of a list among such counted ones.
ListTolerance agreedToleranceBetween(std::span<const ListTolerance> counted, std::uint32_t budget);

/// Adds a counted list.
void addTo(SupersegmentHistogram& histogram, std::span<const Interval> intervals, const SegmentRules& rules,
           std::size_t atOnce = 1);

std::vector<Supersegment> segmentByMerging(std::span<const Interval> intervals, const SegmentRules& rules,
                                           const ListTolerance& listTolerance);
/// With the list's own interpolated tolerance.
std::vector<Supersegment> segmentByMerging(std::span<const Interval> intervals, const SegmentRules& rules);

/// The algorithm of that name.
std::vector<Supersegment> segment(std::span<const Interval> intervals, const SegmentRules& rules,
                                  Algorithm algorithm);

}  // namespace vdi::reference
