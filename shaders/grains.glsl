// Grains: neighbouring intervals that deviate little from the first of them. Twin of grainsOf in
// vdi/reference/SegmentByMerging.cpp; reduce.comp merges grains into supersegments. Counting does all tolerances side by
// side in one walk; writing does one.
//
// Needs: optical.glsl, appearance.glsl; params with sensitivities, counts, offsets, grains, written, left, status,
// survey; where SEVERAL_RANKS is defined, levels, levelShift and quotas too; bool writesGrains, cutAtGaps, byNeed, uint rayShares, constants; uint rayShare; void walk(): feeds every interval
// of the list to grainsAdd, front to back; uint listIndex.
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require

#include "grain.glsl"
void walk();

float grainsBefore;  // transmittance so far
float grainsReach;
uint grainsVisible;
uint grainsAtOnce = 1u;  // samples that an interval stands for
uint grainsRuns;
bool grainsRunVisible;
float grainsPerStep;  // 1 / length of a sample

// What's counted, side by side: one set of grains per tolerance, or, while writing by need, at the two levels of the survey
// that the list's number of supersegments is interpolated from.
const int countedLevels = !writesGrains ? toleranceLevels / int(rayShares) : byNeed ? 2 : 0;
vec4 countedFirst[toleranceLevels];
float countedDeviation[toleranceLevels];
uint countedGrains[toleranceLevels];
uint countedOpen;  // bit j: a grain of tolerance j is open
float finestCounted;
vec2 needTolerances;

// What's written; see Allotment in vdi/reference/Segmenter.h.
float grainTolerance;
float grainAllotted;
uint grainRoom;     // of those that don't begin a run, where there are several ranks
uint grainRuns;     // grains that begin a run; counted where there are several ranks
uint grainSlots;    // of all
uint grainBase;  // where the list's grains are
uint grainsBegun;
bool grainOpen;
vec4 grainFirst;
float grainDeviation;
vec2 grainSpan;  // front, back
float beforeGrain;  // transmittance of what's in front of it
vec4 grainLight;
float grainTransmittance;
bool grainStartsRun;
bool grainCut;  // the next grain starts a run

void closeGrain() {
  uint slot = grainsBegun - 1u;
  if (grainOpen && slot < grainSlots) {
    params.grains.at[grainBase + slot] = storedGrain(grainSpan, beforeGrain, grainLight, grainStartsRun);
  }
  grainOpen = false;
}

void adaptTolerance() {
  uint left = grainRoom - min(grainRoom, grainsBegun - grainRuns);
  if (left >= spareGrains) return;
  float base = grainAllotted < 0.0 ? finestTolerance / toleranceRatio : grainAllotted;
  grainTolerance = left == 0u ? unlimited : base * pow(toleranceRatio, float(spareGrains - left));
}

// Nothing but a run's start may open a grain once the room for them is used up.
bool roomForGrain() { return (cutAtGaps && grainCut) || grainsBegun - grainRuns < grainRoom; }

void beginGrain(float front, vec4 x) {
  closeGrain();
  ++grainsBegun;
  grainFirst = x;
  grainDeviation = 0.0;
  grainStartsRun = cutAtGaps && grainCut;
  if (grainStartsRun) ++grainRuns;
  grainSpan.x = front;
  beforeGrain = grainsBefore;
  grainLight = vec4(0.0);
  grainTransmittance = 1.0;
  grainCut = false;
  adaptTolerance();
}

void absorb(float back, vec3 color, float opacity, float opticalDepth) {
  grainLight = vec4(grainLight.rgb + grainTransmittance * color, min(grainLight.a + opticalDepth, maxOpticalDepth));
  grainSpan.y = back;
  grainTransmittance *= 1.0 - opacity;
  grainOpen = true;
}

void deviate(vec4 x, float weightedLength) {
  if (writesGrains) grainDeviation += weightedLength * differenceOf(x, grainFirst);
  float tolerance = finestCounted;
  uint beyond = 0u;
  [[unroll]] for (int level = 0; level < countedLevels; ++level) {
    if (writesGrains) tolerance = level == 0 ? needTolerances.x : needTolerances.y;
    countedDeviation[level] += weightedLength * differenceOf(x, countedFirst[level]);
    if (countedDeviation[level] > tolerance) beyond |= 1u << level;
    tolerance *= toleranceRatio;
  }
  countedOpen &= ~beyond;
}

// `color` is premultiplied; `x` is the interval's appearance.
void grainsAdd(float front, float back, vec3 color, float opacity, float opticalDepth, vec4 x) {
  bool gap = front > grainsReach;
  float reach = grainsReach;
  grainsReach = back;
  if (gap) grainsRunVisible = false;
  if (gap && cutAtGaps) {
    if (writesGrains) closeGrain();
    countedOpen = 0u;
    grainCut = true;
  }
  bool visible = opticalDepth > 0.0;
  if (!visible && !grainOpen && countedOpen == 0u) return;
  float weight = weightBehind(grainsBefore) * grainsPerStep;
  if (gap && !cutAtGaps) deviate(vec4(0.0), weight * (front - reach));
  deviate(x, weight * (back - front));
  bool deviates = grainDeviation > grainTolerance;
  if (!visible) {
    if (writesGrains && deviates) closeGrain();
    return;
  }
  grainsVisible += grainsAtOnce;
  if (!grainsRunVisible) ++grainsRuns;
  grainsRunVisible = true;
  if (writesGrains) {
    if ((!grainOpen || deviates) && roomForGrain()) beginGrain(front, x);
    absorb(back, color, opacity, opticalDepth);
  }
  [[unroll]] for (int level = 0; level < countedLevels; ++level) {
    if ((countedOpen & (1u << level)) == 0u) {
      ++countedGrains[level];
      countedFirst[level] = x;
      countedDeviation[level] = 0.0;
    }
  }
  if (countedLevels > 0) countedOpen = ~0u;
  grainsBefore *= 1.0 - opacity;
}

void walkForGrains() {
  grainsBefore = 1.0;
  grainsPerStep = 1.0 / params.step;
  grainsReach = 0.0;
  grainsVisible = 0u;
  grainsRuns = 0u;
  grainsRunVisible = false;
  countedOpen = 0u;
  finestCounted = finestTolerance;
  for (uint level = 0u; level < rayShare * uint(countedLevels); ++level) finestCounted *= toleranceRatio;
  [[unroll]] for (int level = 0; level < toleranceLevels; ++level) {
    countedFirst[level] = vec4(0.0);
    countedDeviation[level] = 0.0;
    countedGrains[level] = 0u;
  }
  grainsBegun = 0u;
  grainRuns = 0u;
  grainOpen = false;
  grainFirst = vec4(0.0);
  grainDeviation = 0.0;
  grainCut = true;
  walk();
}

// Twins of roundingOf and supersegmentsAt in vdi/core/Budget.h.
float roundingOf(uint index) { return float((index * 0x9E3779B1u) >> 8) * 5.9604644775390625e-8; }

uint levelBelow() { return min(uint(params.level), surveyLevels - 2u); }

uint interpolatedCount(uint countBelow, uint countAbove, float rounding) {
  float share = params.level - float(levelBelow());
  return max(uint(float(countBelow) + share * (float(countAbove) - float(countBelow)) + rounding), 1u);
}

// What the list would hold at a level of the survey, if anything; for all invocations that share the ray. Twin of
// supersegmentsAtLevel.
uint supersegmentsAtLevel(uint level) {
  uint count = level == 0u ? grainsVisible : 1u;
  uint tolerance = clamp(level, 1u, uint(toleranceLevels)) - 1u;
  uint share = tolerance * rayShares / uint(toleranceLevels);
  uint from = gl_SubgroupInvocationID - rayShare + share;  // who counts for it
  [[unroll]] for (int i = 0; i < countedLevels; ++i) {
    uint counted = rayShares == 1u ? countedGrains[i] : subgroupShuffle(countedGrains[i], from);
    if (level == 1u + share * uint(countedLevels) + uint(i)) count = counted;
  }
  return min(count, params.mostPerList);
}

uint budgetOfList() {
  if (!byNeed) return params.budget;
  return interpolatedCount(supersegmentsAtLevel(levelBelow()), supersegmentsAtLevel(levelBelow() + 1u), 0.5);
}

struct CountedGrains {
  float tolerance;
  uint count;
};

CountedGrains grainsFor(uint budget) {
  uint runs = cutAtGaps ? grainsRuns : min(grainsRuns, 1u);
  uint count = grainsVisible;
  float tolerance = -1.0;
  if (count > max(budget, runs)) {
    uint room = max(grainsPerBudget * budget, runs);
    count = runs;
    tolerance = unlimited;
    float coarser = finestCounted * pow(toleranceRatio, float(countedLevels - 1));
    [[unroll]] for (int level = countedLevels - 1; level >= 0; --level) {
      if (countedGrains[level] <= room) {
        count = countedGrains[level];
        tolerance = coarser;
      }
      coarser /= toleranceRatio;
    }
  }
  return CountedGrains(tolerance, count);
}

// A share's own is coarser where none of its tolerances gives few enough.
CountedGrains finestOfShares(CountedGrains own) {
  for (uint step = 1u; step < rayShares; step *= 2u) {
    CountedGrains other = CountedGrains(subgroupShuffleXor(own.tolerance, step), subgroupShuffleXor(own.count, step));
    if (other.tolerance < own.tolerance) own = other;
  }
  return own;
}

void countGrains() {
  walkForGrains();
  CountedGrains counted = finestOfShares(grainsFor(budgetOfList()));
  if (rayShare != 0u) return;
  params.sensitivities.at[listIndex] = counted.tolerance;
  params.counts.at[listIndex] = counted.count;
}

// Of a level of the survey.
float toleranceOfLevel(uint level) {
  if (level == 0u) return -1.0;
  return level + 1u == surveyLevels ? unlimited : finestTolerance * pow(toleranceRatio, float(level - 1u));
}

// Where the list's grains are, and how many there may be. Returns how many supersegments they may become, but for runs.
uint roomOfList() {
  grainBase = params.offsets.at[listIndex];
  grainSlots = params.counts.at[listIndex];
  grainRoom = grainSlots;
#ifdef SEVERAL_RANKS
  if (cutAtGaps) {
    uint quota = params.quotas.at[listIndex];
    grainRoom -= quota >> 16;
    return quota & 0xffffu;
  }
#endif
  return params.budget;
}

// The list has more runs than its neighbours that were counted: it's written again, in a room for these.
void askForRoom() {
  atomicAdd(params.status.at[0], 1u);
#ifdef SEVERAL_RANKS
  params.counts.at[listIndex] = grainRoom + grainsRuns;
  params.quotas.at[listIndex] = (params.quotas.at[listIndex] & 0xffffu) | grainsRuns << 16;
#endif
}

void writeGrains() {
  if (params.counts.at[listIndex] == 0u) {
    params.written.at[listIndex] = 0u;
    params.left.at[listIndex] = 0u;
    return;
  }
  uint most = roomOfList();
  grainAllotted = params.sensitivities.at[listIndex];
  grainTolerance = grainAllotted;
  if (byNeed) needTolerances = vec2(toleranceOfLevel(levelBelow()), toleranceOfLevel(levelBelow() + 1u));
  walkForGrains();
  closeGrain();
  uint written = min(grainsBegun, grainSlots);
  if (written != grainsBegun) askForRoom();
  most = max(most, cutAtGaps ? grainsRuns : 1u);
  if (byNeed) {
    most = interpolatedCount(min(countedGrains[0], params.mostPerList),
                             min(countedGrains[1], params.mostPerList), roundingOf(listIndex));
  }
  params.written.at[listIndex] = written;
  params.left.at[listIndex] = min(written, most);
}

#ifdef SEVERAL_RANKS
uint levelByte(uint count) { return min((count + (1u << params.levelShift) - 1u) >> params.levelShift, 255u); }

// Grains at a tolerance, for all invocations that share the ray.
uint grainsAtTolerance(uint tolerance) {
  uint share = tolerance * rayShares / uint(toleranceLevels);
  uint from = gl_SubgroupInvocationID - rayShare + share;  // who counts for it
  uint result = 0u;
  [[unroll]] for (int i = 0; i < countedLevels; ++i) {
    uint counted = rayShares == 1u ? countedGrains[i] : subgroupShuffle(countedGrains[i], from);
    if (tolerance == share * uint(countedLevels) + uint(i)) result = counted;
  }
  return result;
}

// What other ranks are told of the list.
void countLevels() {
  walkForGrains();
  uint words[countedLevelWords];
  words[0] = levelByte(grainsVisible);
  words[1] = 0u;
  words[2] = 0u;
  for (uint tolerance = 0u; tolerance < uint(toleranceLevels); ++tolerance) {
    uint place = countedTolerance + tolerance;
    uint bits = levelByte(grainsAtTolerance(tolerance)) << (8u * (place & 3u));
    if (place < 4u) {
      words[0] |= bits;
    } else if (place < 8u) {
      words[1] |= bits;
    } else {
      words[2] |= bits;
    }
  }
  words[2] |= levelByte(grainsRuns) << (8u * (countedRuns & 3u));
  if (rayShare != 0u) return;
  for (uint i = 0u; i < countedLevelWords; ++i) params.levels.at[listIndex * countedLevelWords + i] = words[i];
}
#endif

// What a workgroup's lists add to the survey.
shared uint surveyed[surveyLevels + 1u];

// For all invocations of a workgroup, those without a list included.
void surveyGrains(bool hasList) {
  uint own = gl_LocalInvocationIndex;
  if (own <= surveyLevels) surveyed[own] = 0u;
  barrier();
  if (hasList) {
    walkForGrains();
    if (grainsVisible > 0u) {
      for (uint level = 0u; level < surveyLevels; ++level) {
        uint count = supersegmentsAtLevel(level);
        if (rayShare == 0u) atomicAdd(surveyed[level], count);
      }
      uint equally = min(finestOfShares(grainsFor(params.budget)).count, params.budget);
      if (rayShare == 0u) atomicAdd(surveyed[surveyLevels], equally);
    }
  }
  barrier();
  if (own <= surveyLevels && surveyed[own] > 0u) {
    uint before = atomicAdd(params.survey.at[2u * own], surveyed[own]);
    if (before + surveyed[own] < before) atomicAdd(params.survey.at[2u * own + 1u], 1u);
  }
}
