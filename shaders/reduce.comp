// Merges the grains of each list, cheapest neighbours first, until as few are left as the list may hold. Twin of mergeCheapest
// in vdi/reference/SegmentByMerging.cpp. One invocation a list.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/reduce.h"

layout(local_size_x = reduceGroup) in;
layout(push_constant, scalar) uniform Push { ReduceConstants push; };

#include "optical.glsl"
#include "appearance.glsl"
#include "grain.glsl"

const float merged = 3.2e38;  // cost of a grain that was merged into another; below unlimited, above all else

// Costs of lists of up to that many grains; longer lists keep theirs in the grains.
const uint quickGrains = 80u;
shared float quickCosts[quickGrains * reduceGroup];

uint base;
uint count;

float costAt(uint i) {
  return count <= quickGrains ? quickCosts[i * reduceGroup + gl_LocalInvocationID.x]
                              : push.grains.at[2u * (base + i) + 1u].w;
}

void setCost(uint i, float cost) {
  if (count <= quickGrains) {
    quickCosts[i * reduceGroup + gl_LocalInvocationID.x] = cost;
  } else {
    push.grains.at[2u * (base + i) + 1u].w = cost;
  }
}

Grain grainAt(uint i) {
  uint at = 2u * (base + i);
  return grainOf(push.grains.at[at], push.grains.at[at + 1u]);
}

void setGrain(uint i, Grain g) {
  uint at = 2u * (base + i);
  push.grains.at[at] = firstHalf(g);
  push.grains.at[at + 1u] = secondHalf(g);
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
         ((a.back - a.front) * differenceOf(appearance(a), both) + (b.back - b.front) * differenceOf(appearance(b), both) +
          max(b.front - a.back, 0.0) * differenceOf(vec4(0.0), both));
}

// The next or previous grain that's left; count if there's none.
uint nextOf(uint i) {
  for (++i; i < count && costAt(i) == merged; ++i) {
  }
  return i;
}
uint previousOf(uint i) {
  while (i > 0u) {
    --i;
    if (costAt(i) != merged) return i;
  }
  return count;
}

void mergeCheapest(uint excess) {
  Grain a = grainAt(0u);
  for (uint i = 0u; i + 1u < count; ++i) {
    Grain b = grainAt(i + 1u);
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
    if (least >= merged) return;  // just cuts are left; there are no more of them than may be
    uint other = nextOf(cheapest);
    uint next = nextOf(other);
    uint previous = previousOf(cheapest);
    Grain both = mergedOf(grainAt(cheapest), grainAt(other));
    both.cost = next == count ? unlimited : costOf(both, grainAt(next));
    setGrain(cheapest, both);
    setCost(cheapest, both.cost);
    setCost(other, merged);
    if (previous != count) setCost(previous, costOf(grainAt(previous), both));
  }
}

void writeSegments(uint slot, bool reduced) {
  for (uint i = 0u; i < count; ++i) {
    if (reduced && costAt(i) == merged) continue;
    Grain g = grainAt(i);
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
  bool reduces = reduction.x > reduction.y;
  if (reduces) mergeCheapest(reduction.x - reduction.y);
  writeSegments(push.offsets.at[list], reduces);
}
