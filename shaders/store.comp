// Stores what grains are left as supersegments: one invocation a list, for what rounding one leaves over goes to the next.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/reduce.h"

layout(local_size_x = storeGroup) in;
layout(push_constant, scalar) uniform Push { ReduceConstants push; };

#include "optical.glsl"
#include "exact.glsl"
#include "store.glsl"
#include "grain.glsl"

// Compositing: lists without grains are in ReduceConstants::fitting.
layout(constant_id = 3) const bool mayFit = false;

// The latest codes that aren't in memory yet. Four that fill a piece of a cache line go there together: neighbouring invocations
// write to different lines, and a GPU takes as long for 8 bytes of one as for 32 (storing takes 0.55 of the time on an H200).
uvec2 waiting[3];

// To place `at`, the i-th of `count`.
void storeCode(uvec2 code, uint at, uint i, uint count) {
  uint phase = at & 3u;
  if (phase == 3u && i >= 3u) {
    FourCompactArray(push.segments).at[at / 4u] =
        FourCompact(uvec4(waiting[0], waiting[1]), uvec4(waiting[2], code));
  } else if (phase == 3u || i + 1u == count) {
    CompactArray codes = CompactArray(push.segments);
    uint before = min(phase, i);
    if (before >= 3u) codes.at[at - 3u] = waiting[0];
    if (before >= 2u) codes.at[at - 2u] = waiting[1];
    if (before >= 1u) codes.at[at - 1u] = waiting[2];
    codes.at[at] = code;
  }
  waiting[0] = waiting[1];
  waiting[1] = waiting[2];
  waiting[2] = code;
}

// Two ranks may have rounded depths to codes that overlap.
uvec2 behindReach(uvec2 code) {
  uvec2 depths = depthCodes(code);
  uint front = min(max(depths.x, storeReach), uint(mostDepthCode) - 1u);
  uint back = max(depths.y, front + 1u);
  storeReach = back;
  return uvec2((code.x & 0xf0000000u) | front | back << 14, code.y);
}

void copyFitting(uint from, uint slot, uint count) {
  beginStoring();
  for (uint i = 0u; i < count; ++i) {
    if (compactForm) {
      storeCode(behindReach(CompactArray(push.fitting).at[from + i]), slot + i, i, count);
    } else {
      push.segments.at[slot + i] = push.fitting.at[from + i];
    }
  }
}

void main() {
  if (push.guard.at[0] == 0u) return;
  uint list = gl_GlobalInvocationID.x;
  if (list >= push.listCount) return;
  uint count = push.left.at[list];
  if (count == 0u) return;
  if (mayFit && push.written.at[list] == 0u) {
    copyFitting(push.fittingOffsets.at[list], push.offsets.at[list], count);
    return;
  }
  uint first = push.grainOffsets.at[list];
  uint slot = push.offsets.at[list];
  beginStoring();
  StoredGrain ahead = push.grains.at[first];
  for (uint i = 0u; i < count; ++i) {
    StoredGrain grain = ahead;
    if (i + 1u < count) ahead = push.grains.at[first + i + 1u];
    vec4 light = lightOf(grain);
    Material m = Material(grain.span.x, grain.span.y, light.rgb, light.a);
    if (compactForm) {
      storeCode(compacted(m, push.form), slot + i, i, count);
    } else {
      storeSegment(push.segments, slot + i, m, push.form);
    }
  }
}
