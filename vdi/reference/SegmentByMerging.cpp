// Lists by merging (segmentByMerging in Segmenter.h). The shaders' twins are count_pre_segments.glsl (step
// 1), interpolate.comp (step 2), write_pre_segments.glsl (step 3), merging.glsl and reduce.comp (step 4).
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "vdi/core/TransferFunction.h"
#include "vdi/reference/Segmenter.h"

namespace vdi::reference {

namespace {

using shared::unlimited;

/// Colour and opacity of material over one sample.
struct Appearance {
  float red;
  float green;
  float blue;
  float opacity;
};

Appearance overOneSample(float red, float green, float blue, float opticalDepth, float length,
                         float sampleStep) {
  const float whole = opacityOf(opticalDepth);
  const float part = opacityOf(opticalDepth * sampleStep / length);
  const float scale = whole > 0.0F ? part / whole : 0.0F;
  return {red * scale, green * scale, blue * scale, part};
}

/// Sum of absolute differences: as good as a root of squares here (measured), and cheaper on a device.
float distance(const Appearance& a, const Appearance& b) {
  return std::abs(a.red - b.red) + std::abs(a.green - b.green) + std::abs(a.blue - b.blue) +
         std::abs(a.opacity - b.opacity);
}

/// Weight of an interval behind material of that transmittance.
float weightBehind(float transmittance) {
  return hiddenWeight + (1.0F - hiddenWeight) * transmittance;
}

struct PreSegment {
  float front;
  float back;
  float red;  // premultiplied
  float green;
  float blue;
  float opticalDepth;
  bool cut;                 // must not merge with the pre-segment before it
  float before;             // transmittance in front of it
  Appearance appearance{};  // see setUpCosts
  void absorb(float theBack, float theRed, float theGreen, float theBlue, float theOpticalDepth) {
    const float transmittance = 1.0F - opacityOf(opticalDepth);
    red += transmittance * theRed;
    green += transmittance * theGreen;
    blue += transmittance * theBlue;
    opticalDepth = std::min(opticalDepth + theOpticalDepth, maxExtinction);
    back = theBack;
  }
};

/// A negative tolerance makes each interval a pre-segment. ListTolerance explains `room`.
std::vector<PreSegment> preSegmentsOf(std::span<const Interval> intervals, float initialTolerance,
                                      const SegmentRules& rules,
                                      std::size_t room = std::numeric_limits<std::size_t>::max()) {
  std::vector<PreSegment> preSegments;
  float tolerance = initialTolerance;
  std::size_t runs = 0;  // pre-segments that begin a run
  const auto adaptTolerance = [&] {
    const std::size_t left = room - std::min(room, preSegments.size() - runs);
    if (left >= sparePreSegments) return;
    const float base = initialTolerance < 0.0F ? finestTolerance / toleranceRatio : initialTolerance;
    tolerance =
        left == 0 ? unlimited : base * std::pow(toleranceRatio, static_cast<float>(sparePreSegments - left));
  };
  bool open = false;
  bool cut = true;
  Appearance first{};
  float deviation = 0.0F;
  float before = 1.0F;
  float reach = 0.0F;
  const auto deviate = [&](const Appearance& x, float length) {
    deviation += weightBehind(before) * (length / rules.sampleStep) * distance(x, first);
    if (deviation > tolerance) open = false;
  };
  for (const Interval& i : intervals) {
    if (i.front > reach) {
      if (rules.cutAtGaps) {
        open = false;
        cut = true;
      } else if (open) {
        deviate({}, i.front - reach);
      }
    }
    const Appearance x =
        overOneSample(i.red, i.green, i.blue, i.opticalDepth, i.back - i.front, rules.sampleStep);
    if (open) deviate(x, i.back - i.front);
    if (tolerance < 0.0F) open = false;
    if (i.opticalDepth > 0.0F) {
      if (open) {
        preSegments.back().absorb(i.back, i.red, i.green, i.blue, i.opticalDepth);
      } else {
        preSegments.push_back(
            {i.front, i.back, i.red, i.green, i.blue, i.opticalDepth, rules.cutAtGaps && cut, before});
        runs += rules.cutAtGaps && cut ? 1 : 0;
        first = x;
        deviation = 0.0F;
        open = true;
        cut = false;
        adaptTolerance();
      }
    }
    before *= 1.0F - opacityOf(i.opticalDepth);
    reach = i.back;
  }
  return preSegments;
}

/// The place of two merged neighbours. If they are far apart, the fainter one's light moves to the other's
/// place. Spread over the gap too, most of it would be in the wrong place, in empty space that rays could no
/// longer skip. But a list keeps its first depth, because that is its depth in a picture.
enum class Place { OfBoth, OfFirst, OfSecond };

/// The amount of a pre-segment's material.
float amountOf(const PreSegment& preSegment) {
  return (preSegment.back - preSegment.front) * distance({}, preSegment.appearance);
}

/// The factors make equal lengths and amounts compare the same, however they were rounded.
Place placeOf(const PreSegment& a, const PreSegment& b) {
  const float lengths = (a.back - a.front) + (b.back - b.front);
  if (b.front - a.back < lengths * 0.9999F) return Place::OfBoth;
  if (amountOf(b) <= amountOf(a) * 1.0001F) return Place::OfFirst;
  return a.before < 1.0F ? Place::OfSecond : Place::OfBoth;
}

/// Appearances are those from which costs were computed; the result has none yet.
PreSegment merged(const PreSegment& a, const PreSegment& b) {
  PreSegment result = a;
  result.absorb(b.back, b.red, b.green, b.blue, b.opticalDepth);
  const Place place = placeOf(a, b);
  if (place == Place::OfFirst) result.back = a.back;
  if (place == Place::OfSecond) result.front = b.front;
  return result;
}

/// The change that merging two neighbours makes: the sum over both, and over the gap between them, of the
/// distance to the merged material, times the length.
float costOf(const PreSegment& a, const PreSegment& b) {
  if (b.cut) return unlimited;
  const float first = a.back - a.front;
  const float second = b.back - b.front;
  const float whole = b.back - a.front;
  const float gap = std::max(b.front - a.back, 0.0F);
  const Place place = placeOf(a, b);
  if (place != Place::OfBoth) {
    // The moved material is missing at its old place, and superfluous at the new one.
    return weightBehind(a.before) * 2.0F * amountOf(place == Place::OfFirst ? b : a);
  }
  const auto mean = [&](float x, float y) { return (first * x + second * y) / whole; };
  const Appearance& x = a.appearance;
  const Appearance& y = b.appearance;
  const Appearance both = {mean(x.red, y.red), mean(x.green, y.green), mean(x.blue, y.blue),
                           mean(x.opacity, y.opacity)};
  return weightBehind(a.before) *
         (first * distance(x, both) + second * distance(y, both) + gap * distance({}, both));
}

/// Computes the values from which costs follow.
void setUpCosts(std::vector<PreSegment>& preSegments, float sampleStep) {
  for (PreSegment& g : preSegments)
    g.appearance = overOneSample(g.red, g.green, g.blue, g.opticalDepth, g.back - g.front, sampleStep);
}

/// Costs of merging each pre-segment with the next one; unlimited for the last.
std::vector<float> costsOf(const std::vector<PreSegment>& preSegments) {
  std::vector<float> costs(preSegments.size(), unlimited);
  for (std::size_t i = 0; i + 1 < preSegments.size(); ++i)
    costs[i] = costOf(preSegments[i], preSegments[i + 1]);
  return costs;
}

/// Sum and number of the costs of the possible mergers.
struct Costs {
  float sum = 0.0F;
  float finite = 0.0F;
  void add(float cost) {
    if (cost >= unlimited) return;
    sum += cost;
    finite += 1.0F;
  }
  /// Rounded up, so that equal costs do not exceed their mean.
  float limit() const { return sum / finite * 1.0001F; }
};

/// Equal costs at even places count as cheaper than those at odd ones, so that a round makes every other
/// merger of a long series.
bool isCheapest(const std::vector<float>& costs, std::size_t i) {
  const auto cheaperThan = [&](float other) { return i % 2 == 0 ? costs[i] <= other : costs[i] < other; };
  return (i == 0 || cheaperThan(costs[i - 1])) && (i + 1 == costs.size() || cheaperThan(costs[i + 1]));
}

/// One round, which removes at most `excess` pre-segments. Returns the costs of the mergers not made, as they
/// were before the others were made.
Costs mergeOnce(std::vector<PreSegment>& preSegments, std::size_t excess, float limit, float sampleStep) {
  setUpCosts(preSegments, sampleStep);
  const std::vector<float> costs = costsOf(preSegments);
  Costs others;
  std::vector<PreSegment> left;
  for (std::size_t i = 0; i < preSegments.size(); ++i) {
    if (excess > 0 && costs[i] < unlimited && costs[i] <= limit && isCheapest(costs, i)) {
      left.push_back(merged(preSegments[i], preSegments[i + 1]));
      --excess;
      ++i;  // the absorbed neighbour's own merger is not made
    } else {
      left.push_back(preSegments[i]);
    }
    others.add(costs[i]);
  }
  preSegments = std::move(left);
  return others;
}

void mergeCheapest(std::vector<PreSegment>& preSegments, std::size_t maxCount, float sampleStep) {
  if (preSegments.size() <= maxCount) return;
  setUpCosts(preSegments, sampleStep);
  Costs costs;
  for (const float cost : costsOf(preSegments)) costs.add(cost);
  while (preSegments.size() > maxCount && costs.finite > 0.0F)
    costs = mergeOnce(preSegments, preSegments.size() - maxCount, costs.limit(), sampleStep);
}

}  // namespace

namespace {

static_assert(SupersegmentHistogram::levels == toleranceLevels + 2 &&
              SupersegmentHistogram::levels == shared::histogramLevels);
static_assert(shared::maxOpticalDepth == maxExtinction);

std::size_t visibleSamples(std::span<const Interval> intervals, std::size_t atOnce) {
  return atOnce * static_cast<std::size_t>(
                      std::count_if(intervals.begin(), intervals.end(),
                                    [](const Interval& interval) { return interval.opticalDepth > 0.0F; }));
}

/// The number of supersegments of a list with visible intervals at a level of a SupersegmentHistogram.
std::size_t supersegmentsAtLevel(std::span<const Interval> intervals, const SegmentRules& rules,
                                 std::size_t atOnce, std::size_t level) {
  std::size_t count = 1;
  if (level == 0) count = visibleSamples(intervals, atOnce);
  if (level > 0 && level + 1 < SupersegmentHistogram::levels) {
    const float tolerance = finestTolerance * std::pow(toleranceRatio, static_cast<float>(level - 1));
    count = preSegmentsOf(intervals, tolerance, rules).size();
  }
  return std::min<std::size_t>(count, maxPerList(rules.budget, Budget::Total));
}

/// The number of supersegments that a list with visible intervals may have, apart from runs.
std::size_t budgetOf(std::span<const Interval> intervals, const SegmentRules& rules, std::size_t atOnce,
                     float rounding) {
  if (rules.level < 0.0F) return rules.budget;
  return supersegmentsAt(rules.level, rounding, [&](std::size_t level) {
    return supersegmentsAtLevel(intervals, rules, atOnce, level);
  });
}

}  // namespace

void addTo(SupersegmentHistogram& histogram, std::span<const Interval> intervals, const SegmentRules& rules,
           std::size_t atOnce) {
  if (visibleSamples(intervals, atOnce) == 0) return;
  for (std::size_t level = 0; level < SupersegmentHistogram::levels; ++level)
    histogram.supersegments[level] += supersegmentsAtLevel(intervals, rules, atOnce, level);
  histogram.equally += std::min(listToleranceOf(intervals, rules, atOnce).preSegments, rules.budget);
}

ListTolerance listToleranceOf(std::span<const Interval> intervals, const SegmentRules& rules,
                              std::size_t atOnce) {
  const std::size_t visible = visibleSamples(intervals, atOnce);
  if (visible == 0) return {};
  const std::size_t runs = rules.cutAtGaps ? countRuns(intervals) : 1;
  const std::size_t budget = budgetOf(intervals, rules, atOnce, 0.5F);
  const std::size_t maxCount = std::max(budget, runs);
  float tolerance = -1.0F;
  std::size_t count = visible;
  if (visible > maxCount) {
    const std::size_t room = std::max(preSegmentsPerBudget * budget, runs);
    tolerance = finestTolerance;
    count = preSegmentsOf(intervals, tolerance, rules).size();
    for (int level = 1; count > room; ++level) {
      tolerance = level < toleranceLevels ? tolerance * toleranceRatio : unlimited;
      count = preSegmentsOf(intervals, tolerance, rules).size();
    }
  }
  const auto preSegments = static_cast<std::uint32_t>(count);
  return {tolerance, preSegments, preSegments + sparePreSegments};
}

ListTolerance interpolatedTolerance(std::span<const ListTolerance> counted) {
  ListTolerance result;
  float exponents = 0.0F;
  float count = 0.0F;
  bool exact = true;
  for (const ListTolerance& a : counted) {
    result.preSegments = std::max(result.preSegments, a.preSegments);
    if (a.preSegments == 0) continue;
    exact = exact && a.tolerance < 0.0F;
    exponents += std::log2(a.tolerance < 0.0F ? finestTolerance / toleranceRatio : a.tolerance);
    count += 1.0F;
  }
  if (!exact) result.tolerance = std::exp2(exponents / count);
  result.room = result.preSegments + uncountedSparePreSegments + result.preSegments / 4;
  return result;
}

CountedLevels& CountedLevels::operator+=(const CountedLevels& other) {
  for (std::size_t i = 0; i < counts.size(); ++i)
    counts[i] = static_cast<std::uint8_t>(std::min(counts[i] + other.counts[i], 255));
  return *this;
}

std::uint32_t levelShiftFor(std::uint32_t budget) {
  std::uint32_t shift = 0;
  while ((preSegmentsPerBudget * budget >> shift) >= 255) ++shift;
  return shift;
}

CountedLevels countedLevels(std::span<const Interval> intervals, const SegmentRules& rules,
                            std::size_t atOnce) {
  CountedLevels levels;
  levels.shift = levelShiftFor(rules.budget);
  const auto byteOf = [&](std::size_t count) {
    const std::size_t quantised = (count + (std::size_t{1} << levels.shift) - 1) >> levels.shift;
    return static_cast<std::uint8_t>(std::min<std::size_t>(quantised, 255));
  };
  levels.counts.front() = byteOf(visibleSamples(intervals, atOnce));
  float tolerance = finestTolerance;
  for (std::size_t level = 1; level <= toleranceLevels; ++level, tolerance *= toleranceRatio)
    levels.counts[level] = byteOf(preSegmentsOf(intervals, tolerance, rules).size());
  levels.counts.back() = byteOf(countRuns(intervals));
  return levels;
}

ListTolerance agreedTolerance(const CountedLevels& own, const CountedLevels& sum, std::uint32_t budget) {
  const auto countOf = [](const CountedLevels& levels, std::size_t place) {
    return std::uint32_t{levels.counts[place]} << levels.shift;
  };
  const std::size_t runsPlace = own.counts.size() - 1;
  ListTolerance result;
  result.tolerance = 0.0F;
  if (countOf(sum, 0) == 0) return result;
  std::size_t place = 0;
  result.tolerance = -1.0F;
  if (countOf(sum, 0) > budget) {
    place = 1;
    result.tolerance = finestTolerance;
    while (place < runsPlace && countOf(sum, place) > preSegmentsPerBudget * budget) {
      ++place;
      result.tolerance *= toleranceRatio;
    }
    if (place == runsPlace) result.tolerance = unlimited;
  }
  result.preSegments = countOf(own, place);
  const std::uint32_t all = std::max(countOf(sum, place), 1U);
  const std::uint32_t wanted = std::min(all, budget);
  result.quota = (result.preSegments * wanted + all - 1) / all;
  result.runs = countOf(own, runsPlace);
  return result;
}

ListTolerance agreedToleranceBetween(std::span<const ListTolerance> counted, std::uint32_t budget) {
  std::vector<ListTolerance> known;
  ListTolerance maxCount;
  for (const ListTolerance& a : counted) {
    if (a.tolerance == 0.0F) continue;
    known.push_back(a);
    // Ranks without material in the list must find the same tolerance as ranks with some.
    known.back().preSegments = std::max(a.preSegments, 1U);
    maxCount.preSegments = std::max(maxCount.preSegments, a.preSegments);
    maxCount.quota = std::max(maxCount.quota, a.quota);
    maxCount.runs = std::max(maxCount.runs, a.runs);
  }
  ListTolerance result = interpolatedTolerance(known);
  result.preSegments = maxCount.preSegments;
  result.room = maxCount.preSegments + uncountedSparePreSegments + maxCount.preSegments / 4;
  // A list may have material of this rank even if none of the counted lists around it has.
  result.quota = maxCount.quota > 0 ? maxCount.quota : budget;
  result.runs = maxCount.runs + 1;
  return result;
}

std::vector<Supersegment> segmentByMerging(std::span<const Interval> intervals, const SegmentRules& rules,
                                           const ListTolerance& listTolerance) {
  std::vector<PreSegment> preSegments;
  if (listTolerance.room > 0)
    preSegments = preSegmentsOf(intervals, listTolerance.tolerance, rules, listTolerance.room);
  const std::size_t runs = rules.cutAtGaps ? countRuns(intervals) : 1;
  const std::size_t budget =
      listTolerance.quota > 0 ? listTolerance.quota : budgetOf(intervals, rules, 1, rules.rounding);
  mergeCheapest(preSegments, std::max(budget, runs), rules.sampleStep);
  std::vector<Supersegment> list;
  list.reserve(preSegments.size());
  for (const PreSegment& g : preSegments)
    list.push_back({g.front, g.back, g.red, g.green, g.blue, opacityOf(g.opticalDepth)});
  return list;
}

std::vector<Supersegment> segmentByMerging(std::span<const Interval> intervals, const SegmentRules& rules) {
  return segmentByMerging(intervals, rules, listToleranceOf(intervals, rules));
}

}  // namespace vdi::reference
