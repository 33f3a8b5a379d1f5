// Interpolates, from the counted lists, each list's tolerance and its room for pre-segments. Twin of
// interpolatedTolerance in vdi/reference/SegmentByMerging.cpp.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/interpolate.h"

layout(local_size_x = interpolateGroup) in;
layout(push_constant, scalar) uniform Push { InterpolateConstants push; };

uint maxPreSegments;
uint maxQuota;
uint maxRuns;
bool allExact;
float exponents;
float countedLists;

// Whether this rank is one of several.
layout(constant_id = 0) const bool together = false;

struct Counted {
  float tolerance;
  uint preSegments;
  uint quota;
};

Counted countedAt(uint x, uint y) {
  uint at = y * push.countedWidth + x;
  return Counted(push.countedTolerances.at[at], push.countedPreSegments.at[at],
                 together ? push.countedQuotas.at[at] : 0u);
}

void consider(Counted counted) {
  // All ranks must find the same tolerance, including those without material in the list.
  if (together ? counted.tolerance == 0.0 : counted.preSegments == 0u) return;
  maxQuota = max(maxQuota, counted.quota & 0xffffu);
  maxRuns = max(maxRuns, counted.quota >> 16);
  maxPreSegments = max(maxPreSegments, counted.preSegments);
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
    uint preSegments = push.countedPreSegments.at[list];
    push.tolerances.at[list] = push.countedTolerances.at[list];
    push.capacities.at[list] = preSegments == 0u ? 0u : preSegments + sparePreSegments;
    return;
  }
  uint left = x >> push.strideShift;
  uint below = y >> push.strideShift;
  uint beyond = (1u << push.strideShift) - 1u;
  uint right = min((x + beyond) >> push.strideShift, push.countedWidth - 1u);
  uint above = min((y + beyond) >> push.strideShift, push.countedRows - 1u);
  maxPreSegments = 0u;
  maxQuota = 0u;
  maxRuns = 0u;
  allExact = true;
  exponents = 0.0;
  countedLists = 0.0;
  // Requests all values before it uses any.
  Counted leftBelow = countedAt(left, below);
  Counted rightBelow = countedAt(right, below);
  Counted leftAbove = countedAt(left, above);
  Counted rightAbove = countedAt(right, above);
  consider(leftBelow);
  consider(rightBelow);
  consider(leftAbove);
  consider(rightAbove);
  uint room = maxPreSegments + uncountedSparePreSegments + maxPreSegments / 4u;
  if (together) {
    // A list may have material of this rank even if none of the counted lists around it has.
    uint quota = maxQuota > 0u ? maxQuota : push.budget;
    uint runs = maxRuns + 1u;
    push.quotas.at[list] = quota | runs << 16;
    room += runs;
  }
  push.tolerances.at[list] = allExact ? -1.0 : exp2(exponents / countedLists);
  push.capacities.at[list] = room;
}
