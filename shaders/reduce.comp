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
#include "grain.glsl"

struct Grain {
  vec2 span;  // front, back
  vec4 light;
  bool cut;
  float opacity;
  vec4 appearance;
};

Grain grainOf(vec2 span, vec4 light, bool cut) {
  return Grain(span, light, cut, opacityOf(light.a), appearanceOf(light.rgb, light.a, span.y - span.x, push.step));
}

// The list's grains, one after the other; the next one is on its way while one is used.
uint base;
uint grainCount;
uint nextRead;
StoredGrain grainAhead;

void beginReading(uint count) {
  grainCount = count;
  nextRead = 1u;
  grainAhead = push.grains.at[base];
}

StoredGrain readStored() {
  StoredGrain grain = grainAhead;
  if (nextRead < grainCount) grainAhead = push.grains.at[base + nextRead];
  ++nextRead;
  return grain;
}

Grain readGrain() {
  StoredGrain stored = readStored();
  return grainOf(stored.span, lightOf(stored), isCut(stored));
}

// `before`: transmittance of what's in front of a.
float costOf(Grain a, Grain b, float before) {
  if (b.cut) return unlimited;
  float first = a.span.y - a.span.x;
  float second = b.span.y - b.span.x;
  float whole = b.span.y - a.span.x;
  float gap = b.span.x - a.span.y;
  float weight = weightBehind(before) / whole;
  // What's below, where there's no gap.
  if (!(gap > 0.0)) return 2.0 * weight * first * second * differenceOf(a.appearance, b.appearance);
  vec4 both = first * a.appearance + second * b.appearance;
  return weight * (first * differenceOf(whole * a.appearance, both) + second * differenceOf(whole * b.appearance, both) +
                   gap * differenceOf(vec4(0.0), both));
}

// Of the mergers that are possible: what the next round may cost follows from it.
float costSum;
float costsFinite;

void beginCosts() {
  costSum = 0.0;
  costsFinite = 0.0;
}

void addCost(float cost) {
  bool finite = cost < unlimited;
  costSum += finite ? cost : 0.0;
  costsFinite += finite ? 1.0 : 0.0;
}

// Of at least two grains.
void sumCosts(uint count) {
  beginReading(count);
  beginCosts();
  float before = 1.0;
  Grain a = readGrain();
  for (uint i = 1u; i < count; ++i) {
    Grain b = readGrain();
    addCost(costOf(a, b, before));
    before *= 1.0 - a.opacity;
    a = b;
  }
}

Grain merged(Grain a, Grain b) {
  vec4 light = vec4(a.light.rgb + (1.0 - a.opacity) * b.light.rgb, min(a.light.a + b.light.a, maxOpticalDepth));
  return grainOf(vec2(a.span.x, b.span.y), light, a.cut);
}

// One round, in place, of at least two grains; returns how many are left.
uint mergeOnce(uint count, uint excess, float limit) {
  uint left = 0u;
  float previous = unlimited;
  float before = 1.0;
  beginReading(count);
  Grain a = readGrain();
  Grain b = readGrain();
  float cost = costOf(a, b, before);
  beginCosts();
  for (uint i = 0u; i < count;) {
    Grain c = b;
    float next = unlimited;
    if (i + 2u < count) {
      c = readGrain();
      next = costOf(b, c, before * (1.0 - a.opacity));
    }
    bool merges = excess > 0u && cost < unlimited && cost <= limit && cost <= previous && cost <= next;
    if (merges) {
      a = merged(a, b);
      --excess;
    }
    push.grains.at[base + left++] = storedGrain(a.span, a.light, a.cut);
    before *= 1.0 - a.opacity;
    previous = merges ? next : cost;
    addCost(previous);
    i += merges ? 2u : 1u;
    a = merges ? c : b;
    b = c;
    cost = next;
    if (merges) {
      cost = unlimited;
      if (i + 1u < count) {
        b = readGrain();
        cost = costOf(a, b, before);
      }
    }
  }
  return left;
}

void writeSegments(uint count, uint slot) {
  beginReading(count);
  beginStoring();
  for (uint i = 0u; i < count; ++i) {
    StoredGrain grain = readStored();
    vec4 light = lightOf(grain);
    storeSegment(push.segments, slot + i, Material(grain.span.x, grain.span.y, light.rgb, light.a), push.form);
  }
}

void main() {
  uint list = gl_GlobalInvocationID.x;
  if (list >= push.listCount) return;
  uint count = push.written.at[list];
  uint slot = push.offsets.at[list];
  uint most = push.offsets.at[list + 1u] - slot;
  base = push.grainOffsets.at[list];
  if (count == 0u) return;
  if (count > most) sumCosts(count);
  while (count > most) {
    if (costsFinite == 0.0) break;  // just cuts are left; there are no more of them than may be
    count = mergeOnce(count, count - most, costSum / costsFinite * 1.0001);
  }
  writeSegments(min(count, most), slot);
}
