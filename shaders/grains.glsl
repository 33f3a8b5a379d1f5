// Grains: neighbouring intervals that deviate little from the first of them. Twin of grainsOf in
// vdi/reference/SegmentByMerging.cpp; reduce.comp merges grains into supersegments. Counting does all tolerances side by
// side in one walk; writing does one.
//
// Needs: optical.glsl; push.params.value with sensitivities, counts, offsets, grains, reductions, status; bool writesGrains,
// a constant; void walk(): feeds every interval of the list to grainsAdd, front to back; uint listIndex.
#extension GL_EXT_control_flow_attributes : require
#include "appearance.glsl"

const int toleranceLevels = 8;
const float finestTolerance = 0.002;
const float toleranceRatio = 4.0;

void walk();

float grainsBefore;  // optical depth so far
float grainsReach;
uint grainsVisible;
uint grainsRuns;
bool grainsRunVisible;
bool grainsCutAtGaps;

// One per tolerance while counting, the first alone while writing. A negative deviation: none is open.
vec4 grainFirst[toleranceLevels];
float grainDeviation[toleranceLevels];
uint grainCount[toleranceLevels];

float grainTolerance;  // while writing
Grain grain;
bool grainCut;

void writeGrain() {
  uint slot = grainCount[0] - 1u;
  if (slot < push.params.value.counts.at[listIndex]) {
    push.params.value.grains.at[push.params.value.offsets.at[listIndex] + slot] = grain;
  }
}

void closeGrain(int level) {
  if (writesGrains && grainDeviation[level] >= 0.0) writeGrain();
  grainDeviation[level] = -1.0;
}

void deviate(vec4 x, float weightedLength) {
  float tolerance = writesGrains ? grainTolerance : finestTolerance;
  [[unroll]] for (int level = 0; level < (writesGrains ? 1 : toleranceLevels); ++level) {
    if (grainDeviation[level] >= 0.0) {
      float deviation = grainDeviation[level] + weightedLength * length(x - grainFirst[level]);
      if (deviation > tolerance) {
        closeGrain(level);
      } else {
        grainDeviation[level] = deviation;
      }
    }
    tolerance *= toleranceRatio;
  }
}

// `color` is premultiplied; `x` is the interval's appearance.
void grainsAdd(float front, float back, vec3 color, float opticalDepth, vec4 x) {
  float weight = weightBehind(grainsBefore) / push.params.value.step;
  if (front > grainsReach) {
    grainsRunVisible = false;
    if (grainsCutAtGaps) {
      [[unroll]] for (int level = 0; level < (writesGrains ? 1 : toleranceLevels); ++level) closeGrain(level);
      grainCut = true;
    } else {
      deviate(vec4(0.0), weight * (front - grainsReach));
    }
  }
  deviate(x, weight * (back - front));
  if (opticalDepth > 0.0) {
    ++grainsVisible;
    if (!grainsRunVisible) ++grainsRuns;
    grainsRunVisible = true;
    // Nothing but a run's start may open a grain once the room for them is used up. It isn't, unless the program that
    // counted rounded otherwise.
    bool full = writesGrains && !grainCut && grainCount[0] >= push.params.value.counts.at[listIndex];
    [[unroll]] for (int level = 0; level < (writesGrains ? 1 : toleranceLevels); ++level) {
      if (grainDeviation[level] >= 0.0 || full) {
        if (!writesGrains) continue;
        grain.red += (1.0 - opacityOf(grain.opticalDepth)) * color.r;
        grain.green += (1.0 - opacityOf(grain.opticalDepth)) * color.g;
        grain.blue += (1.0 - opacityOf(grain.opticalDepth)) * color.b;
        grain.opticalDepth = min(grain.opticalDepth + opticalDepth, maxOpticalDepth);
        grain.back = back;
        grainDeviation[level] = max(grainDeviation[level], 0.0);
      } else {
        ++grainCount[level];
        grainFirst[level] = x;
        grainDeviation[level] = 0.0;
        if (writesGrains) {
          float before = grainsCutAtGaps && grainCut ? -1.0 - grainsBefore : grainsBefore;
          grain = Grain(front, back, color.r, color.g, color.b, opticalDepth, before, 0.0);
          grainCut = false;
        }
      }
    }
  }
  grainsBefore += opticalDepth;
  grainsReach = back;
}

void walkForGrains() {
  grainsCutAtGaps = push.params.value.cutAtGaps != 0u;
  grainsBefore = 0.0;
  grainsReach = 0.0;
  grainsVisible = 0u;
  grainsRuns = 0u;
  grainsRunVisible = false;
  grainCut = true;
  [[unroll]] for (int level = 0; level < toleranceLevels; ++level) {
    grainDeviation[level] = -1.0;
    grainCount[level] = 0u;
  }
  walk();
}

void countGrains() {
  walkForGrains();
  uint budget = push.params.value.budget;
  uint runs = grainsCutAtGaps ? grainsRuns : min(grainsRuns, 1u);
  uint count = grainsVisible;
  float tolerance = -1.0;
  if (count > max(budget, runs)) {
    uint room = max(grainsPerBudget * budget, runs);
    count = runs;
    tolerance = unlimited;
    float coarser = finestTolerance * pow(toleranceRatio, float(toleranceLevels - 1));
    [[unroll]] for (int level = toleranceLevels - 1; level >= 0; --level) {
      if (grainCount[level] <= room) {
        count = grainCount[level];
        tolerance = coarser;
      }
      coarser /= toleranceRatio;
    }
  }
  push.params.value.sensitivities.at[listIndex] = tolerance;
  push.params.value.counts.at[listIndex] = count;
}

void writeGrains() {
  if (push.params.value.counts.at[listIndex] == 0u) {
    push.params.value.reductions.at[listIndex] = uvec2(0u);
    return;
  }
  grainTolerance = push.params.value.sensitivities.at[listIndex];
  walkForGrains();
  closeGrain(0);
  uint written = min(grainCount[0], push.params.value.counts.at[listIndex]);
  if (written != grainCount[0]) atomicAdd(push.params.value.status.at[0], 1u);
  uint most = max(push.params.value.budget, grainsCutAtGaps ? grainsRuns : 1u);
  push.params.value.reductions.at[listIndex] = uvec2(written, min(written, most));
}
