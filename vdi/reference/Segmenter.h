// Turns the intervals along one ray into supersegments: the exchangeable part of generation and compositing.
// Generation feeds it samples, compositing feeds it sub-supersegments; both are intervals of constant colour
// (paper, section 5.2). shaders/shared/segmenting.h has the constants. The shaders' twins are segmenter.glsl
// and search.glsl (bisection); pre_segments.glsl, merging.glsl, interpolate.comp, quota.comp and reduce.comp
// (merging).
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

/// A sample or sub-supersegment: a depth interval with premultiplied accumulated colour, and its optical
/// depth -log2(1 - opacity), which adds up where opacities multiply.
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
  /// True for a sub-VDI that will be merged with other ranks' supersegments: a supersegment then never spans
  /// a gap, because another rank's material may lie there. False: a gap is a transparent sample, as in the
  /// paper.
  bool cutAtGaps = false;
  /// A level of a SupersegmentHistogram: merging gives each list its number at that level, up to twice the
  /// budget (Budget::Total). Negative: each list may have `budget`. Not with cutAtGaps.
  float level = -1.0F;
  float rounding = 0.5F;  // with a level: roundingOf the list
};

/// Segments a list for one sensitivity (Eq. 1). Compares premultiplied colour *and* opacity of two sides,
/// normalised to the length of one sample. Opacity is included because dark material would otherwise equal
/// empty space.
///   * A transparent interval never opens a supersegment. An open one absorbs it if Eq. 1 allows; a
///     transparent tail is trimmed when the supersegment closes.
///   * A negative sensitivity cuts at every interval.
std::vector<Supersegment> segmentWithSensitivity(std::span<const Interval> intervals, float sensitivity,
                                                 const SegmentRules& rules);

/// Number of runs: pieces of visible material between gaps.
std::size_t countRuns(std::span<const Interval> intervals);

/// Searches for the sensitivity of a list:
///   * The list may hold max(budget, runs) supersegments. Runs are the pieces that gaps force apart (1
///     without cutAtGaps).
///   * If there are no more visible intervals than that, each becomes a supersegment of its own: nothing is
///     lost.
///   * Otherwise the first try is smallestSensitivity, accepted if it fits.
///   * Otherwise the search bisects the exponent between it and largestSensitivity, which always fits, until
///     a try fills at least 85 % of the list, or the bounds are closer than a factor of 1.001, or after 22
///     tries. The smallest sensitivity found to fit wins.
using shared::closeBounds;
using shared::goodFill;
using shared::largestSensitivity;
using shared::maxTries;
using shared::smallestSensitivity;
std::vector<Supersegment> segmentByBisection(std::span<const Interval> intervals, const SegmentRules& rules);

/// The default: no search for a sensitivity, and no single threshold for the whole list. If there are no more
/// visible intervals than the list may hold (see above), each becomes a supersegment. Otherwise, in the steps
/// of docs/architecture.md:
///   1. Count. Neighbouring intervals join to a pre-segment as long as their deviation from its first one
///      stays within a tolerance. The deviation is the sum of w * |x - x_first| * length / sampleStep, where
///      x is colour and opacity over one sample, and w = hiddenWeight + (1 - hiddenWeight) * transmittance in
///      front is how much V_O sees of it. As in segmentWithSensitivity, a transparent interval opens no
///      pre-segment, and a transparent tail is trimmed. The list's tolerance is the smallest of
///      finestTolerance * toleranceRatio^j, j = 0 .. toleranceLevels - 1, that gives at most
///      preSegmentsPerBudget * budget pre-segments (or the number of runs, if that is larger); if none does,
///      it is infinite.
///   2. Interpolate. A list that wasn't counted gets its tolerance from the counted ones around it
///      (interpolatedTolerance).
///   3. Write the pre-segments with that tolerance.
///   4. Merge. While there are more pre-segments than the list may hold, a round merges neighbours. The cost
///      of merging two is the sum over both, and over the empty space between them, of w * |x - x_mean| *
///      length. Front to back, two are merged if that costs no more than the limit, and no more than merging
///      either of them with its other neighbour (of equal costs, those at even places count as less), until
///      enough are merged. In the first round, the limit is the mean of all costs; later, it is the mean of
///      the costs, at that time, of the mergers that the previous round left out. (As measured, this is as
///      good as always merging the cheapest pair, and it does not search a list again for each merger.)
///   5. Store the rest as supersegments (Compaction.h).
/// One pass along the ray counts all tolerances side by side, so a device needs two passes in all
/// (Budget::Total takes one more, for its SupersegmentHistogram). It counts only one ray of countedStride x
/// countedStride (see ListTolerance).
using shared::finestTolerance;
using shared::hiddenWeight;
using shared::preSegmentsPerBudget;
using shared::toleranceLevels;
using shared::toleranceRatio;

/// The bounds of step 3 for a list: its tolerance, and the number of pre-segments counted. There is room for
/// a few more. When less than sparePreSegments of that room is left, the tolerance grows by toleranceRatio
/// with each further pre-segment, and the last one takes all the rest. So a list that was not counted cannot
/// overflow, however wrong its interpolated tolerance is. Runs are not bounded this way: a device that finds
/// more of them than it has room for writes the list again.
struct ListTolerance {
  float tolerance = -1.0F;  // negative: each interval is a pre-segment
  std::uint32_t preSegments = 0;
  std::uint32_t room = 0;  // >= preSegments + sparePreSegments, or 0 for a list known to be empty
  /// With other ranks (agreedTolerance): the number of supersegments that the list may have, apart from runs,
  /// and the number of runs expected. Pre-segments that begin a run take no room. 0: the rules' budget.
  std::uint32_t quota = 0;
  std::uint32_t runs = 0;
  bool operator==(const ListTolerance&) const = default;
};
using shared::countedSamplesFor;
using shared::countedStride;
using shared::sparePreSegments;
using shared::uncountedSparePreSegments;

/// Counts a list. `atOnce` is the number of samples that an interval represents.
ListTolerance listToleranceOf(std::span<const Interval> intervals, const SegmentRules& rules,
                              std::size_t atOnce = 1);
/// The tolerance of a list between counted ones: the geometric mean of their tolerances, with room for the
/// most pre-segments among them. Empty lists are ignored.
ListTolerance interpolatedTolerance(std::span<const ListTolerance> counted);

/// A rank's counts of a list, in a form that ranks add up: visible samples, pre-segments at each tolerance,
/// runs. Each is divided by 2^shift and rounded up; counts and sums saturate at 255.
struct CountedLevels {
  std::array<std::uint8_t, toleranceLevels + 2> counts{};
  std::uint32_t shift = 0;
  CountedLevels& operator+=(const CountedLevels& other);
};
/// The smallest shift that fits counts into a byte while more than preSegmentsPerBudget * budget pre-segments
/// stay detectable.
std::uint32_t levelShiftFor(std::uint32_t budget);
CountedLevels countedLevels(std::span<const Interval> intervals, const SegmentRules& rules,
                            std::size_t atOnce);
/// One tolerance for all ranks' material in a list: the finest at which the sum of their pre-segments is at
/// most preSegmentsPerBudget * budget. A rank's share of the resulting supersegments equals its share of the
/// pre-segments, so all ranks together send about as much as one would make. The tolerance is 0 if no rank
/// has material.
ListTolerance agreedTolerance(const CountedLevels& own, const CountedLevels& sum, std::uint32_t budget);
/// The agreed tolerance of a list between counted ones.
ListTolerance agreedToleranceBetween(std::span<const ListTolerance> counted, std::uint32_t budget);

/// Adds a counted list to the histogram.
void addTo(SupersegmentHistogram& histogram, std::span<const Interval> intervals, const SegmentRules& rules,
           std::size_t atOnce = 1);

std::vector<Supersegment> segmentByMerging(std::span<const Interval> intervals, const SegmentRules& rules,
                                           const ListTolerance& listTolerance);
/// Merging with the list's own interpolated tolerance.
std::vector<Supersegment> segmentByMerging(std::span<const Interval> intervals, const SegmentRules& rules);

/// Segments by that algorithm.
std::vector<Supersegment> segment(std::span<const Interval> intervals, const SegmentRules& rules,
                                  Algorithm algorithm);

}  // namespace vdi::reference
