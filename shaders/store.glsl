// Supersegments in memory: 24 bytes of floats, or 8 of codes. Storing codes is the twin of
// vdi/reference/Compaction.h; loading them is the twin of `expanded` in vdi/core/Supersegment.cpp.
#ifndef VDI_STORE_GLSL
#define VDI_STORE_GLSL
#include "shared/lists.h"
#include "exact.glsl"
#include "optical.glsl"

// A supersegment that keeps its optical depth even if its opacity rounds to 1.
struct OpticalSegment {
  float front;
  float back;
  vec3 color;  // premultiplied
  float opticalDepth;
};

// The encoding to use, by its number in vdi/core/Encoding.h; the compiler removes the code of the others.
layout(constant_id = 2) const uint encoding = 0u;
const bool compactForm = encoding == 1u;

float opticalDepthOfCode(uint code) {
  return code == 0u ? 9.5367431640625e-7 : (exp2(exactFloat(code) * (16.0 / 4095.0)) - 1.0) / 16.0;
}

uint codeOfOpticalDepth(float opticalDepth) {
  return uint(clamp(round(log2(1.0 + 16.0 * max(opticalDepth, 0.0)) * (4095.0 / 16.0)), 0.0, 4095.0));
}

uvec2 depthCodes(uvec2 packed) { return uvec2(packed.x & 0x3fffu, (packed.x >> 14) & 0x3fffu); }

float codedOpticalDepth(uvec2 packed) { return opticalDepthOfCode(packed.x >> 28 | (packed.y >> 24) << 4); }

// Straight colour.
vec3 codedColor(uvec2 packed) {
  return vec3(exactFloat(packed.y & 0xffu), exactFloat((packed.y >> 8) & 0xffu),
              exactFloat((packed.y >> 16) & 0xffu)) *
         (1.0 / 255.0);
}

vec2 codedDepths(uvec2 packed, StoredForm form) {
  return form.depthFirst + vec2(depthCodes(packed)) * form.depthStep;
}

OpticalSegment loadSegment(SegmentArray segments, uint i, StoredForm form) {
  if (compactForm) {
    uvec2 packed = CompactArray(segments).at[i];
    vec2 depths = codedDepths(packed, form);
    float opticalDepth = codedOpticalDepth(packed);
    return OpticalSegment(depths.x, depths.y, codedColor(packed) * opacityOf(opticalDepth), opticalDepth);
  }
  Segment s = segmentsFrom(segments, i).at[0];
  return OpticalSegment(s.front, s.back, vec3(s.red, s.green, s.blue), opticalDepthOf(s.opacity));
}

// Rounding errors of the list's supersegments so far.
uint storeReach;
float storeDepth;        // optical depth so far
float storeStoredDepth;  // optical depth of the stored supersegments
float storeCarriedDepth;
vec3 storeCarriedLight;

void beginStoring() {
  storeReach = 0u;
  storeDepth = 0.0;
  storeStoredDepth = 0.0;
  storeCarriedDepth = 0.0;
  storeCarriedLight = vec3(0.0);
}

uvec2 compacted(OpticalSegment segment, StoredForm form) {
  vec2 places = round((vec2(segment.front, segment.back) - form.depthFirst) / form.depthStep);
  uvec2 codes = uvec2(clamp(places, vec2(0.0), vec2(maxDepthCode)));
  uint front = min(max(codes.x, storeReach), uint(maxDepthCode) - 1u);
  uint back = max(codes.y, front + 1u);
  storeReach = back;

  float slack = maxDepthChange * segment.opticalDepth + thinnestStep;
  uint depth = codeOfOpticalDepth(segment.opticalDepth + clamp(storeCarriedDepth, -slack, slack));
  float stored = opticalDepthOfCode(depth);

  vec3 light = exp2(-storeDepth) * segment.color;
  float seen = exp2(-storeStoredDepth) * opacityOf(stored);
  vec3 straight = segment.color / opacityOf(segment.opticalDepth);
  vec3 color = straight;
  if (seen > unseen) {
    color = clamp((storeCarriedLight + light) / seen, straight - maxColorChange, straight + maxColorChange);
  }
  vec3 colorCodes = round(clamp(color, vec3(0.0), vec3(1.0)) * 255.0);

  storeCarriedLight += light - seen / 255.0 * colorCodes;
  storeCarriedDepth =
      clamp(storeCarriedDepth + segment.opticalDepth - stored, -maxCarriedDepth, maxCarriedDepth);
  storeDepth += segment.opticalDepth;
  storeStoredDepth += stored;
  uvec3 c = uvec3(colorCodes);
  return uvec2(front | back << 14 | (depth & 0xfu) << 28, c.r | c.g << 8 | c.b << 16 | (depth >> 4) << 24);
}

// Stores the supersegments of a list one after the other, front to back, after beginStoring.
void storeSegment(SegmentArray segments, uint slot, OpticalSegment segment, StoredForm form) {
  if (compactForm) {
    CompactArray(segments).at[slot] = compacted(segment, form);
  } else {
    segmentsFrom(segments, slot).at[0] =
        Segment(segment.front, segment.back, segment.color.r, segment.color.g, segment.color.b,
                opacityOf(segment.opticalDepth));
  }
}

// The latest codes of a list that are not in memory yet. Four that fill a sector of a cache line are written
// together: neighbouring invocations write to different lines, and a GPU takes as long for 8 bytes of a line
// as for 32 (on an H200, storing takes 0.55 of the time).
uvec2 waiting[3];

// Stores the i-th of `count` codes at place `at`.
void storeCode(CompactArray codes, uvec2 code, uint at, uint i, uint count) {
  uint phase = at & 3u;
  if (phase == 3u && i >= 3u) {
    FourCompactArray(codes).at[at / 4u] = FourCompact(uvec4(waiting[0], waiting[1]), uvec4(waiting[2], code));
  } else if (phase == 3u || i + 1u == count) {
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

#endif
