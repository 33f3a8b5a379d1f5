// Stores reduced pre-segments as supersegments, one invocation per list, because a supersegment's rounding
// error is carried to the next one.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/reduce.h"

layout(local_size_x = storeGroup) in;
layout(push_constant, scalar) uniform Push { ReduceConstants push; };

#include "store.glsl"
#include "stored_pre_segment.glsl"

// Compositing: lists without pre-segments are in ReduceConstants::fitting.
layout(constant_id = 3) const bool mayFit = false;

// Moves depths behind those before: depths that two ranks rounded to codes may overlap.
uvec2 behindReach(uvec2 code) {
  uvec2 depths = depthCodes(code);
  uint front = min(max(depths.x, storeReach), uint(maxDepthCode) - 1u);
  uint back = max(depths.y, front + 1u);
  storeReach = back;
  return uvec2((code.x & 0xf0000000u) | front | back << 14, code.y);
}

void copyFitting(uint from, uint slot, uint count) {
  beginStoring();
  for (uint i = 0u; i < count; ++i) {
    if (compactForm) {
      storeCode(CompactArray(push.segments), behindReach(CompactArray(push.fitting).at[from + i]), slot + i,
                i, count);
    } else {
      segmentsFrom(push.segments, slot + i).at[0] = segmentsFrom(push.fitting, from + i).at[0];
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
  PreSegmentArray preSegments = preSegmentsFrom(push.preSegments, push.preSegmentOffsets.at[list]);
  uint slot = push.offsets.at[list];
  beginStoring();
  StoredPreSegment ahead = preSegments.at[0];
  for (uint i = 0u; i < count; ++i) {
    StoredPreSegment preSegment = ahead;
    if (i + 1u < count) ahead = preSegments.at[i + 1u];
    vec4 light = lightOf(preSegment);
    OpticalSegment segment = OpticalSegment(preSegment.span.x, preSegment.span.y, light.rgb, light.a);
    if (compactForm) {
      storeCode(CompactArray(push.segments), compacted(segment, push.form), slot + i, i, count);
    } else {
      storeSegment(push.segments, slot + i, segment, push.form);
    }
  }
}
