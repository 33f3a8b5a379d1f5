// Finds, from all ranks' counts of a list, the tolerance at which the sum of their pre-segments fits, and
// this rank's quota of the list's supersegments. Twin of agreedTolerance in
// vdi/reference/SegmentByMerging.cpp.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/quota.h"

layout(local_size_x = quotaGroup) in;
layout(push_constant, scalar) uniform Push { QuotaConstants push; };

struct Levels {
  uint words[countedLevelWords];
};

Levels ownOf(uint list) {
  Levels levels;
  for (uint i = 0u; i < countedLevelWords; ++i) levels.words[i] = push.own.at[list * countedLevelWords + i];
  return levels;
}

Levels sumOf(uint list) {
  Levels levels;
  for (uint i = 0u; i < countedLevelWords; ++i) levels.words[i] = push.sum.at[list * countedLevelWords + i];
  return levels;
}

uint countOf(Levels levels, uint place) {
  uint word = place < 4u ? levels.words[0] : place < 8u ? levels.words[1] : levels.words[2];
  return ((word >> (8u * (place & 3u))) & 255u) << push.levelShift;
}

void main() {
  uint x = gl_GlobalInvocationID.x;
  uint y = gl_GlobalInvocationID.y;
  if (x >= push.width) return;
  uint list = y * push.width + x;
  Levels own = ownOf(list);
  Levels sum = sumOf(list);
  float tolerance = 0.0;
  uint preSegments = 0u;
  uint quota = 0u;
  if (countOf(sum, 0u) > 0u) {
    uint room = preSegmentsPerBudget * push.budget;
    // All ranks' runs together may exceed the room; each rank then keeps its own.
    tolerance = unlimited;
    uint place = countedRuns;
    if (countOf(sum, 0u) <= push.budget) {
      tolerance = -1.0;
      place = 0u;
    } else {
      float coarser = finestTolerance * pow(toleranceRatio, float(push.levelCount - 1u));
      for (uint level = push.levelCount; level-- > 0u;) {
        if (countOf(sum, countedTolerance + level) <= room) {
          tolerance = coarser;
          place = countedTolerance + level;
        }
        coarser /= toleranceRatio;
      }
    }
    preSegments = countOf(own, place);
    uint all = max(countOf(sum, place), 1u);
    uint wanted = min(all, push.budget);
    quota = (preSegments * wanted + all - 1u) / all;
    atomicAdd(push.weights.at[y], wanted);
  }
  push.tolerances.at[list] = tolerance;
  push.preSegments.at[list] = preSegments;
  push.quotas.at[list] = min(quota, 0xffffu) | min(countOf(own, countedRuns), 0xffffu) << 16;
}
