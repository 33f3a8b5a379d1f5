// Counts a list's pre-segments at several tolerances side by side, without writing them. The counts
// decide the list's tolerance and room, and its share of a total budget; other ranks receive them.
//
// The program provides params with thresholds, capacities, histogram, budget, level, maxPerList;
// where SEVERAL_RANKS is defined, levels and levelShift, too; uint lanesPerRay, bool
// writesPreSegments, cutAtGaps, byNeed, constants; uint rayLane.
#ifndef VDI_COUNT_PRE_SEGMENTS_GLSL
#define VDI_COUNT_PRE_SEGMENTS_GLSL
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "interval.glsl"

// A counting program counts at all tolerances; lanes that share a ray share the tolerances, too. A
// program that writes by need counts at two levels of the histogram, between which it interpolates
// the list's number of supersegments.
const int countedLevels =
    !writesPreSegments ? toleranceLevels / int(lanesPerRay) : byNeed ? 2 : 0;

struct CountedPreSegments {
  vec4 first[toleranceLevels];  // appearance of the last pre-segment's first interval
  float deviation[toleranceLevels];
  uint preSegments[toleranceLevels];
};

// A global, unlike all other state, which functions receive as arguments. `inout` copies an argument at
// each call, and these arrays stay in memory until the compiler has unrolled the loops over levels. A
// compiler that removes copies before it unrolls would keep a copy of 48 words in each sample.
CountedPreSegments counted;

// The rest of a counter's state.
struct PreSegmentCounter {
  uint open;      // bit j: a pre-segment of level j is open
  float finest;   // the least of this lane's tolerances
  vec2 atLevels;  // tolerances of the two levels, while writing by need
};

PreSegmentCounter beginCounter() {
  PreSegmentCounter counter = PreSegmentCounter(0u, finestTolerance, vec2(0.0));
  for (uint level = 0u; level < rayLane * uint(countedLevels); ++level)
    counter.finest *= toleranceRatio;
  [[unroll]] for (int level = 0; level < toleranceLevels; ++level) {
    counted.first[level] = vec4(0.0);
    counted.deviation[level] = 0.0;
    counted.preSegments[level] = 0u;
  }
  return counter;
}

// Ends the pre-segments that deviate too much because of material `x` of that weighted length.
void deviate(inout PreSegmentCounter counter, vec4 x, float weightedLength) {
  float tolerance = counter.finest;
  uint beyond = 0u;
  [[unroll]] for (int level = 0; level < countedLevels; ++level) {
    if (writesPreSegments) tolerance = level == 0 ? counter.atLevels.x : counter.atLevels.y;
    counted.deviation[level] += weightedLength * differenceOf(x, counted.first[level]);
    if (counted.deviation[level] > tolerance) beyond |= 1u << level;
    tolerance *= toleranceRatio;
  }
  counter.open &= ~beyond;
}

// Adds a visible interval, which begins a pre-segment wherever none is open.
void addVisible(inout PreSegmentCounter counter, vec4 x) {
  uint open = counter.open;
  [[unroll]] for (int level = 0; level < countedLevels; ++level) {
    if ((open & (1u << level)) == 0u) {
      ++counted.preSegments[level];
      counted.first[level] = x;
      counted.deviation[level] = 0.0;
    }
  }
  counter.open = ~0u;
}

// Twins of roundingOf and supersegmentsAt in vdi/core/Budget.h.
float roundingOf(uint index) { return float((index * 0x9E3779B1u) >> 8) * 5.9604644775390625e-8; }

uint levelBelow() { return min(uint(params.level), histogramLevels - 2u); }

uint interpolatedCount(uint countBelow, uint countAbove, float rounding) {
  float share = params.level - float(levelBelow());
  float count = float(countBelow) + share * (float(countAbove) - float(countBelow));
  return max(uint(count + rounding), 1u);
}

float toleranceOfLevel(uint level) {
  if (level == 0u) return -1.0;
  if (level + 1u == histogramLevels) return unlimited;
  return finestTolerance * pow(toleranceRatio, float(level - 1u));
}

// All invocations that share a ray call the following functions together.

// Number of pre-segments at a tolerance; `otherwise` if there is no such tolerance.
uint preSegmentsAt(uint tolerance, uint otherwise) {
  uint lane = min(tolerance, uint(toleranceLevels) - 1u) * lanesPerRay / uint(toleranceLevels);
  uint from = gl_SubgroupInvocationID - rayLane + lane;  // the lane that counts at this tolerance
  uint result = otherwise;
  [[unroll]] for (int i = 0; i < countedLevels; ++i) {
    uint own = counted.preSegments[i];
    uint there = lanesPerRay == 1u ? own : subgroupShuffle(own, from);
    if (tolerance == lane * uint(countedLevels) + uint(i)) result = there;
  }
  return result;
}

// The list's number of supersegments at a level of the histogram, if the list has any. Twin of
// supersegmentsAtLevel in vdi/reference/SegmentByMerging.cpp.
uint supersegmentsAtLevel(ListProgress progress, uint level) {
  return min(preSegmentsAt(level - 1u, level == 0u ? progress.visible : 1u), params.maxPerList);
}

uint budgetOfList(ListProgress progress) {
  if (!byNeed) return params.budget;
  return interpolatedCount(supersegmentsAtLevel(progress, levelBelow()),
                           supersegmentsAtLevel(progress, levelBelow() + 1u), 0.5);
}

struct CountAtTolerance {
  float tolerance;
  uint preSegments;
};

// The finest of this lane's tolerances that gives few enough pre-segments.
CountAtTolerance finestOwn(ListProgress progress, PreSegmentCounter counter, uint budget) {
  uint runs = cutAtGaps ? progress.runs : min(progress.runs, 1u);
  CountAtTolerance result = CountAtTolerance(-1.0, progress.visible);
  if (progress.visible > max(budget, runs)) {
    uint room = max(preSegmentsPerBudget * budget, runs);
    result = CountAtTolerance(unlimited, runs);
    float coarser = counter.finest * pow(toleranceRatio, float(countedLevels - 1));
    [[unroll]] for (int level = countedLevels - 1; level >= 0; --level) {
      if (counted.preSegments[level] <= room)
        result = CountAtTolerance(coarser, counted.preSegments[level]);
      coarser /= toleranceRatio;
    }
  }
  return result;
}

// The finest of all lanes' tolerances; a lane's own is coarser if none of its tolerances fits.
CountAtTolerance finestOfLanes(ListProgress progress, PreSegmentCounter counter, uint budget) {
  CountAtTolerance finest = finestOwn(progress, counter, budget);
  for (uint step = 1u; step < lanesPerRay; step *= 2u) {
    CountAtTolerance other = CountAtTolerance(subgroupShuffleXor(finest.tolerance, step),
                                              subgroupShuffleXor(finest.preSegments, step));
    if (other.tolerance < finest.tolerance) finest = other;
  }
  return finest;
}

// Stores the tolerance that a list gets, and the number of pre-segments there.
void storeTolerance(ListProgress progress, PreSegmentCounter counter, uint list) {
  CountAtTolerance finest = finestOfLanes(progress, counter, budgetOfList(progress));
  if (rayLane != 0u) return;
  params.thresholds.at[list] = finest.tolerance;
  params.capacities.at[list] = finest.preSegments;
}

#ifdef SEVERAL_RANKS
uint levelByte(uint count) {
  return min((count + (1u << params.levelShift) - 1u) >> params.levelShift, 255u);
}

// Stores this rank's counts of a list for other ranks.
void storeLevels(ListProgress progress, uint list) {
  uint words[countedLevelWords];
  words[0] = levelByte(progress.visible);
  words[1] = 0u;
  words[2] = 0u;
  for (uint tolerance = 0u; tolerance < uint(toleranceLevels); ++tolerance) {
    uint place = countedTolerance + tolerance;
    uint bits = levelByte(preSegmentsAt(tolerance, 0u)) << (8u * (place & 3u));
    if (place < 4u) {
      words[0] |= bits;
    } else if (place < 8u) {
      words[1] |= bits;
    } else {
      words[2] |= bits;
    }
  }
  words[2] |= levelByte(progress.runs) << (8u * (countedRuns & 3u));
  if (rayLane != 0u) return;
  for (uint i = 0u; i < countedLevelWords; ++i)
    params.levels.at[list * countedLevelWords + i] = words[i];
}
#endif

// Sum over the workgroup's lists, for the histogram.
shared uint groupHistogram[histogramLevels + 1u];

// All invocations of a workgroup must call this and addToHistogram, including those without a list.
void clearGroupHistogram() {
  if (gl_LocalInvocationIndex <= histogramLevels) groupHistogram[gl_LocalInvocationIndex] = 0u;
  barrier();
}

void addToHistogram(ListProgress progress, PreSegmentCounter counter, bool hasList) {
  if (hasList && progress.visible > 0u) {
    for (uint level = 0u; level < histogramLevels; ++level) {
      uint count = supersegmentsAtLevel(progress, level);
      if (rayLane == 0u) atomicAdd(groupHistogram[level], count);
    }
    uint preSegments = finestOfLanes(progress, counter, params.budget).preSegments;
    uint equally = min(preSegments, params.budget);
    if (rayLane == 0u) atomicAdd(groupHistogram[histogramLevels], equally);
  }
  barrier();
  uint own = gl_LocalInvocationIndex;
  if (own <= histogramLevels && groupHistogram[own] > 0u) {
    uint before = atomicAdd(params.histogram.at[2u * own], groupHistogram[own]);
    if (before + groupHistogram[own] < before) atomicAdd(params.histogram.at[2u * own + 1u], 1u);
  }
}

#endif
