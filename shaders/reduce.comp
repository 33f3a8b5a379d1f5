// Merges the grains of each list, in rounds, until as few are left as the list may hold. Twin of mergeCheapest in
// vdi/reference/SegmentByMerging.cpp. One invocation a list, which goes through its grains front to back, several times:
// little state, so that many lists are in flight and hide the latency of memory.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/reduce.h"

layout(local_size_x = reduceGroup) in;
layout(push_constant, scalar) uniform Push { ReduceConstants push; };

#include "optical.glsl"
#include "appearance.glsl"
#include "store.glsl"

uint base;

Grain grainAt(uint i) {
  vec4 depths = push.grains.at[2u * (base + i)];
  return Grain(depths.x, depths.y, depths.z, floatBitsToUint(depths.w), push.grains.at[2u * (base + i) + 1u]);
}

void setGrain(uint i, Grain g) {
  push.grains.at[2u * (base + i)] = vec4(g.front, g.back, g.before, uintBitsToFloat(g.first));
  push.grains.at[2u * (base + i) + 1u] = g.mean;
}

vec4 meanOf(Grain a, Grain b) {
  float whole = b.back - a.front;
  return (a.back - a.front) / whole * a.mean + (b.back - b.front) / whole * b.mean;
}

float costOf(Grain a, Grain b) {
  if (b.before < 0.0) return unlimited;
  vec4 both = meanOf(a, b);
  float before = a.before < 0.0 ? -1.0 - a.before : a.before;
  return weightBehind(before) * ((a.back - a.front) * differenceOf(a.mean, both) +
                                 (b.back - b.front) * differenceOf(b.mean, both) +
                                 max(b.front - a.back, 0.0) * differenceOf(vec4(0.0), both));
}

// Costs of merging each grain with the one before it, of a list that's being written front to back: what the next round
// may cost follows from their sum.
Grain costPrevious;
float costSum;
float costsFinite;

void beginCosts() {
  costSum = 0.0;
  costsFinite = 0.0;
}

void setGrainAndCost(uint i, Grain g) {
  setGrain(i, g);
  float cost = i > 0u ? costOf(costPrevious, g) : unlimited;
  bool finite = cost < unlimited;
  costSum += finite ? cost : 0.0;
  costsFinite += finite ? 1.0 : 0.0;
  costPrevious = g;
}

// One round, in place; returns how many grains are left.
uint mergeOnce(uint count, uint excess, float limit) {
  uint left = 0u;
  float previous = unlimited;
  Grain a = grainAt(0u);
  Grain b = grainAt(1u);
  float cost = costOf(a, b);
  beginCosts();
  for (uint i = 0u; i < count;) {
    Grain c = b;
    float next = unlimited;
    if (i + 2u < count) {
      c = grainAt(i + 2u);
      next = costOf(b, c);
    }
    bool merges = excess > 0u && cost < unlimited && cost <= limit && cost <= previous && cost <= next;
    if (merges) {
      a.mean = meanOf(a, b);
      a.back = b.back;
      --excess;
    }
    setGrainAndCost(left++, a);
    previous = merges ? next : cost;
    i += merges ? 2u : 1u;
    if (i >= count) break;
    if (merges) {
      a = c;
      b = c;
      cost = unlimited;
      if (i + 1u < count) {
        b = grainAt(i + 1u);
        cost = costOf(a, b);
      }
    } else {
      a = b;
      b = c;
      cost = next;
    }
  }
  return left;
}

vec4 lightAt(uint i) {
  vec4 light = push.lights.at[base + i];
  return vec4(light.rgb, abs(light.a));
}

void setUpGrains(uint count) {
  float before = 1.0;
  beginCosts();
  for (uint i = 0u; i < count; ++i) {
    vec2 span = push.spans.at[base + i];
    vec4 light = push.lights.at[base + i];
    bool cut = light.a < 0.0;
    light.a = abs(light.a);
    setGrainAndCost(i, Grain(span.x, span.y, cut ? -1.0 - before : before, i,
                             appearanceOf(light.rgb, light.a, span.y - span.x, push.step)));
    before *= 1.0 - opacityOf(light.a);
  }
}

void writeGrainsAsSegments(uint count, uint slot) {
  for (uint i = 0u; i < count; ++i) {
    vec2 span = push.spans.at[base + i];
    vec4 light = lightAt(i);
    storeSegment(push.segments, slot + i, Material(span.x, span.y, light.rgb, light.a), push.form);
  }
}

// Light of the grains that were merged is put together here, front to back.
void writeSegments(uint count, uint grains, uint slot) {
  for (uint i = 0u; i < count; ++i) {
    Grain g = grainAt(i);
    uint end = i + 1u < count ? floatBitsToUint(push.grains.at[2u * (base + i) + 2u].w) : grains;
    vec4 light = lightAt(g.first);
    for (uint j = g.first + 1u; j < end; ++j) {
      vec4 more = lightAt(j);
      light = vec4(light.rgb + (1.0 - opacityOf(light.a)) * more.rgb, min(light.a + more.a, maxOpticalDepth));
    }
    storeSegment(push.segments, slot + i, Material(g.front, g.back, light.rgb, light.a), push.form);
  }
}

void main() {
  uint list = gl_GlobalInvocationID.x;
  if (list >= push.listCount) return;
  uint written = push.written.at[list];
  uint slot = push.offsets.at[list];
  uint most = push.offsets.at[list + 1u] - slot;
  base = push.grainOffsets.at[list];
  beginStoring();
  if (written <= most) {
    writeGrainsAsSegments(written, slot);
    return;
  }
  setUpGrains(written);
  uint count = written;
  while (count > most) {
    if (costsFinite == 0.0) break;  // just cuts are left; there are no more of them than may be
    count = mergeOnce(count, count - most, costSum / costsFinite * 1.0001);
  }
  writeSegments(min(count, most), written, slot);
}
