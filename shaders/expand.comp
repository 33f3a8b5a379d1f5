// Prepares a VDI for render.comp: supersegments that need no decoding, and masks of the depths with material.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/render.h"

layout(local_size_x = expandGroup) in;
layout(push_constant, scalar) uniform Push { ExpandConstants push; };

#include "masks.glsl"
#include "optical.glsl"
#include "exact.glsl"
#include "store.glsl"
#include "render_segment.glsl"
#include "box_faces.glsl"
#include "slopes.glsl"

void expandSegment(uint i) {
  OpticalSegment segment = loadSegment(push.from, i, push.form);
  float density = segment.opticalDepth / (segment.back - segment.front);
  push.segments.at[i] = RenderSegment(segment.front, segment.back, density,
                                      packedSegmentColor(segment.color / opacityOf(segment.opticalDepth)));
}

shared uint groupNearest;
shared uint groupFarthest;

// Lists are in order of depth, so their ends suffice. Depths are at least 0, but 0 may be -0, whose bits
// exceed all others.
void addDepths(uint list, bool hasList) {
  if (gl_LocalInvocationIndex == 0u) {
    groupNearest = push.depthRange.at[0];
    groupFarthest = push.depthRange.at[1];
  }
  barrier();
  uint first = hasList ? push.offsets.at[list] : 0u;
  uint end = hasList ? push.offsets.at[list + 1u] : 0u;
  if (first < end) {
    atomicMin(groupNearest, floatBitsToUint(abs(renderSegmentsFrom(push.segments, first).at[0].front)));
    atomicMax(groupFarthest, floatBitsToUint(abs(renderSegmentsFrom(push.segments, end - 1u).at[0].back)));
  }
  barrier();
  if (gl_LocalInvocationIndex != 0u) return;
  // Most workgroups do not extend the range.
  if (groupNearest < push.depthRange.at[0]) atomicMin(push.depthRange.at[0], groupNearest);
  if (groupFarthest > push.depthRange.at[1]) atomicMax(push.depthRange.at[1], groupFarthest);
}

// In perspective, the frusta of V_O's pixels meet in its eye, where no bin can separate them.
void findBins() {
  float nearest = uintBitsToFloat(push.depthRange.at[0]);
  float farthest = uintBitsToFloat(push.depthRange.at[1]);
  if (push.perspective != 0u) nearest = max(nearest, farthest * 1e-6);
  push.depthRange.at[0] = floatBitsToUint(nearest);
  push.depthRange.at[2] =
      floatBitsToUint(farthest > nearest ? float(renderBins) / (farthest - nearest) : 0.0);
}

// The distance by which a leaning face moves within a list. Rays are intersected with a list up to half a
// list from its middle along one axis, and one and a half lists along the other.
float reachOf(vec2 slopes) { return 1.5 * max(slopes.x, slopes.y) + 0.5 * min(slopes.x, slopes.y); }

void maskList(uint list, uint first, uint count, bool leans) {
  float nearest = uintBitsToFloat(push.depthRange.at[0]);
  float farthest = uintBitsToFloat(push.depthRange.at[1]);
  float binScale = uintBitsToFloat(push.depthRange.at[2]);
  float slopeUnit = footprintOf() * (renderMaxSlope / renderSlopes);
  float reach = 0.0;
  uint64_t mask = 0ul;
  RenderSegmentArray segments = renderSegmentsFrom(push.segments, first);
  UintArray slopesOfList = uintsFrom(push.slopes, first);
  ivec2 pixel = ivec2(int(list) % push.lists.x, int(list) / push.lists.x);
  for (uint i = 0u; i < count; ++i) {
    RenderSegment segment = segments.at[i];
    vec4 slopes = leans ? segmentSlopes(slopesOfList.at[i]) : vec4(0.0);
    vec2 ends = vec2(segment.front, segment.back);
    // An end on a face doesn't count as reach: it is the list's first front or last back, and every
    // intersection that comes so far looks at it.
    if (frontIsOnFace(slopes)) {
      ends.x = clamp(faceDepthsAround(boxPassage(pixel).enter, pixel).x, nearest, ends.x);
    } else {
      float front = reachOf(abs(slopes.xy));
      reach = max(reach, front);
      ends.x -= slopeUnit * front;
    }
    if (backIsOnFace(slopes)) {
      ends.y = clamp(faceDepthsAround(boxPassage(pixel).leave, pixel).y, ends.y, farthest);
    } else {
      float back = reachOf(abs(slopes.zw));
      reach = max(reach, back);
      ends.y += slopeUnit * back;
    }
    mask |= maskOf(ends.x, ends.y, nearest, binScale);
  }
  push.heads.at[list] = ListHead(first, count | uint(ceil(reach / listReachUnit)) << listCountBits, mask);
}

// The mask includes the lists around the tile, which smooth reconstruction uses within the tile.
void maskTile(ivec2 tile, uint index) {
  uint64_t mask = 0ul;
  ivec2 begin = max(tile * renderTile - 1, ivec2(0));
  ivec2 end = min((tile + 1) * renderTile + 1, push.lists);
  for (int y = begin.y; y < end.y; ++y) {
    for (int x = begin.x; x < end.x; ++x) mask |= push.heads.at[uint(y) * uint(push.lists.x) + uint(x)].mask;
  }
  push.tileDepthMasks.at[index] = mask;
}

void maskLargeTile(ivec2 largeTile, ivec2 tiles, uint index) {
  uint64_t mask = 0ul;
  ivec2 end = min((largeTile + 1) * (renderLargeTile / renderTile), tiles);
  for (int y = largeTile.y * (renderLargeTile / renderTile); y < end.y; ++y) {
    for (int x = largeTile.x * (renderLargeTile / renderTile); x < end.x; ++x)
        mask |= push.tileDepthMasks.at[uint(y * tiles.x + x)];
  }
  push.tileDepthMasks.at[index] = mask;
}

void main() {
  uint i = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * gl_NumWorkGroups.x * expandGroup;
  uint listCount = uint(push.lists.x) * uint(push.lists.y);
  if (push.mode == expandModeSegments) {
    if (i < push.count) expandSegment(i);
  } else if (push.mode == expandModeDepths) {
    addDepths(i, i < listCount);
  } else if (push.mode == expandModeBins) {
    if (i == 0u) findBins();
  } else if (push.mode == expandModeMasks) {
    uint first = i < listCount ? push.offsets.at[i] : 0u;
    if (i < listCount) maskList(i, first, push.offsets.at[i + 1u] - first, false);
  } else if (push.mode == expandModeSlopes) {
    if (i < listCount) findSlopes(ivec2(int(i) % push.lists.x, int(i) / push.lists.x));
  } else if (push.mode == expandModeLeaningMasks) {
    if (i < listCount) maskList(i, push.heads.at[i].first, segmentCount(push.heads.at[i]), true);
  } else {
    ivec2 tiles = tilesOf(push.lists, renderTile);
    ivec2 largeTiles = tilesOf(push.lists, renderLargeTile);
    uint count = uint(tiles.x * tiles.y);
    if (push.mode == expandModeTiles) {
      if (i < count) maskTile(ivec2(int(i) % tiles.x, int(i) / tiles.x), i);
    } else if (i < uint(largeTiles.x * largeTiles.y)) {
      maskLargeTile(ivec2(int(i) % largeTiles.x, int(i) / largeTiles.x), tiles, count + i);
    }
  }
}
