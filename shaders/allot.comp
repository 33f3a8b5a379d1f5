// How finely each list may be cut into grains, and how many of them there's room for, from the lists that were counted. Twin
// of allotmentBetween in vdi/reference/SegmentByMerging.cpp.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/allot.h"

layout(local_size_x = allotGroup) in;
layout(push_constant, scalar) uniform Push { AllotConstants push; };

uint mostGrains;
uint mostQuota;
uint mostRuns;
bool allExact;
float exponents;
float countedLists;

// Whether this is one rank of several.
layout(constant_id = 0) const bool together = false;

struct Counted {
  float tolerance;
  uint grains;
  uint quota;
};

Counted countedAt(uint x, uint y) {
  uint at = y * push.countedWidth + x;
  return Counted(push.countedTolerances.at[at], push.countedGrains.at[at], together ? push.countedQuotas.at[at] : 0u);
}

void consider(Counted counted) {
  // All ranks find the same tolerance: those that have nothing in a list where others have something, too.
  if (together ? counted.tolerance == 0.0 : counted.grains == 0u) return;
  mostQuota = max(mostQuota, counted.quota & 0xffffu);
  mostRuns = max(mostRuns, counted.quota >> 16);
  mostGrains = max(mostGrains, counted.grains);
  if (counted.tolerance >= 0.0) allExact = false;
  exponents += log2(counted.tolerance < 0.0 ? finestTolerance / toleranceRatio : counted.tolerance);
  countedLists += 1.0;
}

void main() {
  uint x = gl_GlobalInvocationID.x;
  uint y = gl_GlobalInvocationID.y;
  if (x >= push.width) return;
  uint list = y * push.width + x;
  if (push.strideShift == 0u) {
    uint grains = push.countedGrains.at[list];
    push.tolerances.at[list] = push.countedTolerances.at[list];
    push.rooms.at[list] = grains == 0u ? 0u : grains + spareGrains;
    return;
  }
  uint left = x >> push.strideShift;
  uint below = y >> push.strideShift;
  uint beyond = (1u << push.strideShift) - 1u;
  uint right = min((x + beyond) >> push.strideShift, push.countedWidth - 1u);
  uint above = min((y + beyond) >> push.strideShift, push.countedRows - 1u);
  mostGrains = 0u;
  mostQuota = 0u;
  mostRuns = 0u;
  allExact = true;
  exponents = 0.0;
  countedLists = 0.0;
  // All are asked for before any is used.
  Counted leftBelow = countedAt(left, below);
  Counted rightBelow = countedAt(right, below);
  Counted leftAbove = countedAt(left, above);
  Counted rightAbove = countedAt(right, above);
  consider(leftBelow);
  consider(rightBelow);
  consider(leftAbove);
  consider(rightAbove);
  uint room = mostGrains + uncountedSpareGrains + mostGrains / 4u;
  if (together) {
    // Where none of the counted lists has anything of this rank's, this one may have.
    uint quota = mostQuota > 0u ? mostQuota : push.budget;
    uint runs = mostRuns + 1u;
    push.quotas.at[list] = quota | runs << 16;
    room += runs;
  }
  push.tolerances.at[list] = allExact ? -1.0 : exp2(exponents / countedLists);
  push.rooms.at[list] = room;
}
