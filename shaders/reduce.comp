// Merges the grains of each list, cheapest neighbours first, until as few are left as the list may hold. Twin of mergeCheapest
// in vdi/reference/SegmentByMerging.cpp. One invocation a list.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/reduce.h"

layout(local_size_x = reduceGroup) in;
layout(push_constant, scalar) uniform Push { ReduceConstants push; };

#include "optical.glsl"
#include "appearance.glsl"

const float dead = -1.0;  // back of a grain that was merged into another

// Costs of lists of up to that many grains; longer lists keep theirs in the grains.
const uint quickGrains = 96u;
shared float quickCosts[quickGrains * reduceGroup];

uint base;
uint count;

float costAt(uint i) {
  return count <= quickGrains ? quickCosts[i * reduceGroup + gl_LocalInvocationID.x] : push.grains.at[base + i].cost;
}

void setCost(uint i, float cost) {
  if (count <= quickGrains) {
    quickCosts[i * reduceGroup + gl_LocalInvocationID.x] = cost;
  } else {
    push.grains.at[base + i].cost = cost;
  }
}

vec4 appearance(Grain g) {
  return appearanceOf(vec3(g.red, g.green, g.blue), g.opticalDepth, g.back - g.front, push.step);
}

Grain mergedOf(Grain a, Grain b) {
  float transmittance = 1.0 - opacityOf(a.opticalDepth);
  a.red += transmittance * b.red;
  a.green += transmittance * b.green;
  a.blue += transmittance * b.blue;
  a.opticalDepth = min(a.opticalDepth + b.opticalDepth, maxOpticalDepth);
  a.back = b.back;
  return a;
}

float costOf(Grain a, Grain b) {
  if (b.before < 0.0) return unlimited;
  vec4 both = appearance(mergedOf(a, b));
  float before = a.before < 0.0 ? -1.0 - a.before : a.before;
  return weightBehind(before) *
         ((a.back - a.front) * length(appearance(a) - both) + (b.back - b.front) * length(appearance(b) - both) +
          max(b.front - a.back, 0.0) * length(both));
}

// The next or previous grain that's left; count if there's none.
uint nextOf(uint i) {
  for (++i; i < count && push.grains.at[base + i].back == dead; ++i) {
  }
  return i;
}
uint previousOf(uint i) {
  while (i > 0u) {
    --i;
    if (push.grains.at[base + i].back != dead) return i;
  }
  return count;
}

void mergeCheapest(uint excess) {
  Grain a = push.grains.at[base];
  for (uint i = 0u; i + 1u < count; ++i) {
    Grain b = push.grains.at[base + i + 1u];
    setCost(i, costOf(a, b));
    a = b;
  }
  setCost(count - 1u, unlimited);
  for (; excess > 0u; --excess) {
    uint cheapest = 0u;
    float least = costAt(0u);
    for (uint i = 1u; i < count; ++i) {
      float cost = costAt(i);
      if (cost < least) {
        least = cost;
        cheapest = i;
      }
    }
    uint other = nextOf(cheapest);
    if (other == count) return;  // just cuts are left; there are no more of them than may be
    Grain merged = mergedOf(push.grains.at[base + cheapest], push.grains.at[base + other]);
    push.grains.at[base + cheapest] = merged;
    push.grains.at[base + other].back = dead;
    setCost(other, unlimited);
    uint next = nextOf(other);
    setCost(cheapest, next == count ? unlimited : costOf(merged, push.grains.at[base + next]));
    uint previous = previousOf(cheapest);
    if (previous != count) setCost(previous, costOf(push.grains.at[base + previous], merged));
  }
}

void writeSegments(uint slot) {
  for (uint i = 0u; i < count; ++i) {
    Grain g = push.grains.at[base + i];
    if (g.back == dead) continue;
    push.segments.at[slot++] = Segment(g.front, g.back, g.red, g.green, g.blue, opacityOf(g.opticalDepth));
  }
}

void main() {
  uint list = gl_GlobalInvocationID.x;
  if (list >= push.listCount) return;
  uvec2 reduction = push.reductions.at[list];
  if (push.mode == reduceModeCount) {
    push.counts.at[list] = reduction.y;
    return;
  }
  base = push.grainOffsets.at[list];
  count = reduction.x;
  if (count == 0u) return;
  if (reduction.x > reduction.y) mergeCheapest(reduction.x - reduction.y);
  writeSegments(push.offsets.at[list]);
}
