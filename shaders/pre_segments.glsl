// Pre-segments: runs of neighbouring intervals that deviate little from the first of them. Twin of
// preSegmentsOf in vdi/reference/SegmentByMerging.cpp; reduce.comp merges pre-segments into supersegments.
// Counting handles all tolerances side by side in one pass; writing handles one.
//
// Needs: optical.glsl, appearance.glsl; params with thresholds, capacities, offsets, preSegments, written,
// left, status, histogram; where SEVERAL_RANKS is defined, levels, levelShift and quotas too; bool
// writesPreSegments, cutAtGaps, byNeed, uint lanesPerRay, constants; uint rayLane; void feedIntervals():
// feeds every interval of the list to preSegmentsAdd, front to back; uint listIndex.
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require

#include "stored_pre_segment.glsl"
void feedIntervals();

float preSegmentsBefore;  // transmittance so far
float preSegmentsReach;
uint preSegmentsVisible;
uint preSegmentsAtOnce = 1u;  // samples per interval
uint preSegmentsRuns;
bool preSegmentsRunVisible;
float preSegmentsPerStep;  // 1 / length of a sample

// The counts, side by side: of one set of pre-segments per tolerance, or, while writing by need, at the two
// levels of the histogram between which the list's number of supersegments is interpolated.
const int countedLevels = !writesPreSegments ? toleranceLevels / int(lanesPerRay) : byNeed ? 2 : 0;
vec4 countedFirst[toleranceLevels];
float countedDeviation[toleranceLevels];
uint countedPreSegments[toleranceLevels];
uint countedOpen;  // bit j: a pre-segment of tolerance j is open
float finestCounted;
vec2 needTolerances;

// The state of writing; ListTolerance in vdi/reference/Segmenter.h explains it.
float preSegmentTolerance;
float initialTolerance;
uint preSegmentRoom;     // for pre-segments that do not begin a run, if there are several ranks
uint preSegmentRuns;     // pre-segments that begin a run; counted if there are several ranks
uint preSegmentSlots;    // for all pre-segments
PreSegmentArray ownPreSegments;  // the list's
uint preSegmentsBegun;
bool preSegmentOpen;
vec4 preSegmentFirst;
float preSegmentDeviation;
vec2 preSegmentSpan;  // front, back
float beforePreSegment;  // transmittance in front of it
vec4 preSegmentLight;
float preSegmentTransmittance;
bool preSegmentStartsRun;
bool preSegmentCut;  // whether the next pre-segment starts a run

void closePreSegment() {
  uint slot = preSegmentsBegun - 1u;
  if (preSegmentOpen && slot < preSegmentSlots) {
    ownPreSegments.at[slot] =
        storedPreSegment(preSegmentSpan, beforePreSegment, preSegmentLight, preSegmentStartsRun);
  }
  preSegmentOpen = false;
}

void adaptTolerance() {
  uint left = preSegmentRoom - min(preSegmentRoom, preSegmentsBegun - preSegmentRuns);
  if (left >= sparePreSegments) return;
  float base = initialTolerance < 0.0 ? finestTolerance / toleranceRatio : initialTolerance;
  preSegmentTolerance = left == 0u ? unlimited : base * pow(toleranceRatio, float(sparePreSegments - left));
}

// Once the room is used up, only the start of a run may open a pre-segment.
bool roomForPreSegment() {
  return (cutAtGaps && preSegmentCut) || preSegmentsBegun - preSegmentRuns < preSegmentRoom;
}

void beginPreSegment(float front, vec4 x) {
  closePreSegment();
  ++preSegmentsBegun;
  preSegmentFirst = x;
  preSegmentDeviation = 0.0;
  preSegmentStartsRun = cutAtGaps && preSegmentCut;
  if (preSegmentStartsRun) ++preSegmentRuns;
  preSegmentSpan.x = front;
  beforePreSegment = preSegmentsBefore;
  preSegmentLight = vec4(0.0);
  preSegmentTransmittance = 1.0;
  preSegmentCut = false;
  adaptTolerance();
}

void absorb(float back, vec3 color, float opacity, float opticalDepth) {
  preSegmentLight = vec4(preSegmentLight.rgb + preSegmentTransmittance * color,
                         min(preSegmentLight.a + opticalDepth, maxOpticalDepth));
  preSegmentSpan.y = back;
  preSegmentTransmittance *= 1.0 - opacity;
  preSegmentOpen = true;
}

void deviate(vec4 x, float weightedLength) {
  if (writesPreSegments) preSegmentDeviation += weightedLength * differenceOf(x, preSegmentFirst);
  float tolerance = finestCounted;
  uint beyond = 0u;
  [[unroll]] for (int level = 0; level < countedLevels; ++level) {
    if (writesPreSegments) tolerance = level == 0 ? needTolerances.x : needTolerances.y;
    countedDeviation[level] += weightedLength * differenceOf(x, countedFirst[level]);
    if (countedDeviation[level] > tolerance) beyond |= 1u << level;
    tolerance *= toleranceRatio;
  }
  countedOpen &= ~beyond;
}

// `color` is premultiplied; `x` is the interval's appearance.
void preSegmentsAdd(float front, float back, vec3 color, float opacity, float opticalDepth, vec4 x) {
  bool gap = front > preSegmentsReach;
  float reach = preSegmentsReach;
  preSegmentsReach = back;
  if (gap) preSegmentsRunVisible = false;
  if (gap && cutAtGaps) {
    if (writesPreSegments) closePreSegment();
    countedOpen = 0u;
    preSegmentCut = true;
  }
  bool visible = opticalDepth > 0.0;
  if (!visible && !preSegmentOpen && countedOpen == 0u) return;
  float weight = weightBehind(preSegmentsBefore) * preSegmentsPerStep;
  if (gap && !cutAtGaps) deviate(vec4(0.0), weight * (front - reach));
  deviate(x, weight * (back - front));
  bool deviates = preSegmentDeviation > preSegmentTolerance;
  if (!visible) {
    if (writesPreSegments && deviates) closePreSegment();
    return;
  }
  preSegmentsVisible += preSegmentsAtOnce;
  if (!preSegmentsRunVisible) ++preSegmentsRuns;
  preSegmentsRunVisible = true;
  if (writesPreSegments) {
    if ((!preSegmentOpen || deviates) && roomForPreSegment()) beginPreSegment(front, x);
    absorb(back, color, opacity, opticalDepth);
  }
  [[unroll]] for (int level = 0; level < countedLevels; ++level) {
    if ((countedOpen & (1u << level)) == 0u) {
      ++countedPreSegments[level];
      countedFirst[level] = x;
      countedDeviation[level] = 0.0;
    }
  }
  if (countedLevels > 0) countedOpen = ~0u;
  preSegmentsBefore *= 1.0 - opacity;
}

void feedPreSegments() {
  preSegmentsBefore = 1.0;
  preSegmentsPerStep = 1.0 / params.step;
  preSegmentsReach = 0.0;
  preSegmentsVisible = 0u;
  preSegmentsRuns = 0u;
  preSegmentsRunVisible = false;
  countedOpen = 0u;
  finestCounted = finestTolerance;
  for (uint level = 0u; level < rayLane * uint(countedLevels); ++level) finestCounted *= toleranceRatio;
  [[unroll]] for (int level = 0; level < toleranceLevels; ++level) {
    countedFirst[level] = vec4(0.0);
    countedDeviation[level] = 0.0;
    countedPreSegments[level] = 0u;
  }
  preSegmentsBegun = 0u;
  preSegmentRuns = 0u;
  preSegmentOpen = false;
  preSegmentFirst = vec4(0.0);
  preSegmentDeviation = 0.0;
  preSegmentCut = true;
  feedIntervals();
}

// Twins of roundingOf and supersegmentsAt in vdi/core/Budget.h.
float roundingOf(uint index) { return float((index * 0x9E3779B1u) >> 8) * 5.9604644775390625e-8; }

uint levelBelow() { return min(uint(params.level), histogramLevels - 2u); }

uint interpolatedCount(uint countBelow, uint countAbove, float rounding) {
  float share = params.level - float(levelBelow());
  return max(uint(float(countBelow) + share * (float(countAbove) - float(countBelow)) + rounding), 1u);
}

// The list's number of supersegments at a level of the histogram, if it has any; for all invocations that
// share the ray. Twin of supersegmentsAtLevel.
uint supersegmentsAtLevel(uint level) {
  uint count = level == 0u ? preSegmentsVisible : 1u;
  uint tolerance = clamp(level, 1u, uint(toleranceLevels)) - 1u;
  uint lane = tolerance * lanesPerRay / uint(toleranceLevels);
  uint from = gl_SubgroupInvocationID - rayLane + lane;  // the lane that counts for it
  [[unroll]] for (int i = 0; i < countedLevels; ++i) {
    uint counted = lanesPerRay == 1u ? countedPreSegments[i] : subgroupShuffle(countedPreSegments[i], from);
    if (level == 1u + lane * uint(countedLevels) + uint(i)) count = counted;
  }
  return min(count, params.maxPerList);
}

uint budgetOfList() {
  if (!byNeed) return params.budget;
  return interpolatedCount(supersegmentsAtLevel(levelBelow()), supersegmentsAtLevel(levelBelow() + 1u), 0.5);
}

struct CountedPreSegments {
  float tolerance;
  uint count;
};

CountedPreSegments preSegmentsFor(uint budget) {
  uint runs = cutAtGaps ? preSegmentsRuns : min(preSegmentsRuns, 1u);
  uint count = preSegmentsVisible;
  float tolerance = -1.0;
  if (count > max(budget, runs)) {
    uint room = max(preSegmentsPerBudget * budget, runs);
    count = runs;
    tolerance = unlimited;
    float coarser = finestCounted * pow(toleranceRatio, float(countedLevels - 1));
    [[unroll]] for (int level = countedLevels - 1; level >= 0; --level) {
      if (countedPreSegments[level] <= room) {
        count = countedPreSegments[level];
        tolerance = coarser;
      }
      coarser /= toleranceRatio;
    }
  }
  return CountedPreSegments(tolerance, count);
}

// A lane's own tolerance is coarser if none of its tolerances fits.
CountedPreSegments finestOfLanes(CountedPreSegments own) {
  for (uint step = 1u; step < lanesPerRay; step *= 2u) {
    CountedPreSegments other =
        CountedPreSegments(subgroupShuffleXor(own.tolerance, step), subgroupShuffleXor(own.count, step));
    if (other.tolerance < own.tolerance) own = other;
  }
  return own;
}

void countPreSegments() {
  feedPreSegments();
  CountedPreSegments counted = finestOfLanes(preSegmentsFor(budgetOfList()));
  if (rayLane != 0u) return;
  params.thresholds.at[listIndex] = counted.tolerance;
  params.capacities.at[listIndex] = counted.count;
}

// Tolerance of a level of the histogram.
float toleranceOfLevel(uint level) {
  if (level == 0u) return -1.0;
  return level + 1u == histogramLevels ? unlimited : finestTolerance * pow(toleranceRatio, float(level - 1u));
}

// Sets the position of, and the room for, the list's pre-segments. Returns how many supersegments they may
// become, apart from runs.
uint roomOfList() {
  ownPreSegments = preSegmentsFrom(params.preSegments, params.offsets.at[listIndex]);
  preSegmentSlots = params.capacities.at[listIndex];
  preSegmentRoom = preSegmentSlots;
#ifdef SEVERAL_RANKS
  if (cutAtGaps) {
    uint quota = params.quotas.at[listIndex];
    preSegmentRoom -= quota >> 16;
    return quota & 0xffffu;
  }
#endif
  return params.budget;
}

// The list has more runs than the counted lists around it: requests to write it again with room for these.
void askForRoom() {
  atomicAdd(params.status.at[statusWrongLists], 1u);
#ifdef SEVERAL_RANKS
  atomicMax(params.status.at[statusMostRuns], preSegmentsRuns);
  params.capacities.at[listIndex] = preSegmentRoom + preSegmentsRuns;
  params.quotas.at[listIndex] = (params.quotas.at[listIndex] & 0xffffu) | preSegmentsRuns << 16;
#endif
}

void writePreSegments() {
  if (params.capacities.at[listIndex] == 0u) {
    params.written.at[listIndex] = 0u;
    params.left.at[listIndex] = 0u;
    return;
  }
  uint maxCount = roomOfList();
  initialTolerance = params.thresholds.at[listIndex];
  preSegmentTolerance = initialTolerance;
  if (byNeed) needTolerances = vec2(toleranceOfLevel(levelBelow()), toleranceOfLevel(levelBelow() + 1u));
  feedPreSegments();
  closePreSegment();
  uint written = min(preSegmentsBegun, preSegmentSlots);
  if (written != preSegmentsBegun) askForRoom();
  maxCount = max(maxCount, cutAtGaps ? preSegmentsRuns : 1u);
  if (byNeed) {
    maxCount = interpolatedCount(min(countedPreSegments[0], params.maxPerList),
                             min(countedPreSegments[1], params.maxPerList), roundingOf(listIndex));
  }
  params.written.at[listIndex] = written;
  params.left.at[listIndex] = min(written, maxCount);
}

#ifdef SEVERAL_RANKS
uint levelByte(uint count) {
  return min((count + (1u << params.levelShift) - 1u) >> params.levelShift, 255u);
}

// Number of pre-segments at a tolerance, for all invocations that share the ray.
uint preSegmentsAtTolerance(uint tolerance) {
  uint lane = tolerance * lanesPerRay / uint(toleranceLevels);
  uint from = gl_SubgroupInvocationID - rayLane + lane;  // the lane that counts for it
  uint result = 0u;
  [[unroll]] for (int i = 0; i < countedLevels; ++i) {
    uint counted = lanesPerRay == 1u ? countedPreSegments[i] : subgroupShuffle(countedPreSegments[i], from);
    if (tolerance == lane * uint(countedLevels) + uint(i)) result = counted;
  }
  return result;
}

// Writes this rank's counts of the list for other ranks.
void countLevels() {
  feedPreSegments();
  uint words[countedLevelWords];
  words[0] = levelByte(preSegmentsVisible);
  words[1] = 0u;
  words[2] = 0u;
  for (uint tolerance = 0u; tolerance < uint(toleranceLevels); ++tolerance) {
    uint place = countedTolerance + tolerance;
    uint bits = levelByte(preSegmentsAtTolerance(tolerance)) << (8u * (place & 3u));
    if (place < 4u) {
      words[0] |= bits;
    } else if (place < 8u) {
      words[1] |= bits;
    } else {
      words[2] |= bits;
    }
  }
  words[2] |= levelByte(preSegmentsRuns) << (8u * (countedRuns & 3u));
  if (rayLane != 0u) return;
  for (uint i = 0u; i < countedLevelWords; ++i)
    params.levels.at[listIndex * countedLevelWords + i] = words[i];
}
#endif

// Sum over the workgroup's lists, for the histogram.
shared uint groupHistogram[histogramLevels + 1u];

// All invocations of a workgroup must call this, including those without a list.
void addToHistogram(bool hasList) {
  uint own = gl_LocalInvocationIndex;
  if (own <= histogramLevels) groupHistogram[own] = 0u;
  barrier();
  if (hasList) {
    feedPreSegments();
    if (preSegmentsVisible > 0u) {
      for (uint level = 0u; level < histogramLevels; ++level) {
        uint count = supersegmentsAtLevel(level);
        if (rayLane == 0u) atomicAdd(groupHistogram[level], count);
      }
      uint equally = min(finestOfLanes(preSegmentsFor(params.budget)).count, params.budget);
      if (rayLane == 0u) atomicAdd(groupHistogram[histogramLevels], equally);
    }
  }
  barrier();
  if (own <= histogramLevels && groupHistogram[own] > 0u) {
    uint before = atomicAdd(params.histogram.at[2u * own], groupHistogram[own]);
    if (before + groupHistogram[own] < before) atomicAdd(params.histogram.at[2u * own + 1u], 1u);
  }
}
