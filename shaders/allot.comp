// How finely each list may be cut into grains, and how many of them there's room for, from the lists that were counted. Twin
// of allotmentBetween in vdi/reference/SegmentByMerging.cpp.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/allot.h"

layout(local_size_x = allotGroup) in;
layout(push_constant, scalar) uniform Push { AllotConstants push; };

#include "tolerance.glsl"

uint mostGrains;
bool allExact;
float exponents;
float countedLists;

void consider(uint x, uint y) {
  uint at = y * push.countedWidth + x;
  uint grains = push.countedGrains.at[at];
  float tolerance = push.countedTolerances.at[at];
  if (grains == 0u) return;
  mostGrains = max(mostGrains, grains);
  if (tolerance >= 0.0) allExact = false;
  exponents += log2(tolerance < 0.0 ? finestTolerance / toleranceRatio : tolerance);
  countedLists += 1.0;
}

void main() {
  uint list = gl_GlobalInvocationID.x;
  if (list >= push.width * push.rows) return;
  uint x = list % push.width;
  uint y = list / push.width;
  uint left = x / push.stride;
  uint below = y / push.stride;
  if (push.stride == 1u) {
    uint grains = push.countedGrains.at[list];
    push.tolerances.at[list] = push.countedTolerances.at[list];
    push.rooms.at[list] = grains == 0u ? 0u : grains + spareGrains;
    return;
  }
  uint right = min((x + push.stride - 1u) / push.stride, push.countedWidth - 1u);
  uint above = min((y + push.stride - 1u) / push.stride, push.countedRows - 1u);
  mostGrains = 0u;
  allExact = true;
  exponents = 0.0;
  countedLists = 0.0;
  consider(left, below);
  consider(right, below);
  consider(left, above);
  consider(right, above);
  push.tolerances.at[list] = allExact ? -1.0 : exp2(exponents / countedLists);
  push.rooms.at[list] = mostGrains + uncountedSpareGrains + mostGrains / 4u;
}
