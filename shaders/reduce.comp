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

// What merging may cost in this round; negative if nothing can be merged.
float limitOf(uint count) {
  float sum = 0.0;
  float finite = 0.0;
  Grain a = grainAt(0u);
  for (uint i = 1u; i < count; ++i) {
    Grain b = grainAt(i);
    float cost = costOf(a, b);
    if (cost < unlimited) {
      sum += cost;
      finite += 1.0;
    }
    a = b;
  }
  return finite > 0.0 ? sum / finite * 1.0001 : -1.0;
}

// One round, in place; returns how many grains are left.
uint mergeOnce(uint count, uint excess, float limit) {
  uint left = 0u;
  float previous = unlimited;
  Grain a = grainAt(0u);
  Grain b = grainAt(1u);
  float cost = costOf(a, b);
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
    setGrain(left++, a);
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

// Light of the grains that were merged is put together here, front to back.
void writeSegments(uint count, uint grains, uint slot) {
  beginStoring();
  for (uint i = 0u; i < count; ++i) {
    Grain g = grainAt(i);
    uint end = i + 1u < count ? floatBitsToUint(push.grains.at[2u * (base + i) + 2u].w) : grains;
    vec4 light = push.lights.at[base + g.first];
    for (uint j = g.first + 1u; j < end; ++j) {
      vec4 more = push.lights.at[base + j];
      light = vec4(light.rgb + (1.0 - opacityOf(light.a)) * more.rgb, min(light.a + more.a, maxOpticalDepth));
    }
    storeSegment(push.segments, slot + i, Material(g.front, g.back, light.rgb, light.a), push.form);
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
  uint count = reduction.x;
  while (count > reduction.y) {
    float limit = limitOf(count);
    if (limit < 0.0) break;  // just cuts are left; there are no more of them than may be
    count = mergeOnce(count, count - reduction.y, limit);
  }
  writeSegments(min(count, reduction.y), reduction.x, push.offsets.at[list]);
}
