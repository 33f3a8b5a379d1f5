// What render.comp wants of a VDI: supersegments that need no decoding, and masks of where there's material.
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

void expandSegment(uint i) {
  OpticalSegment segment = loadSegment(push.from, i, push.form);
  float density = segment.opticalDepth / (segment.back - segment.front);
  push.segments.at[push.first + i] =
      RenderSegment(segment.front, segment.back, density, packedSegmentColor(segment.color / opacityOf(segment.opticalDepth)));
}

void maskList(uint list) {
  uint64_t mask = 0ul;
  uint first = push.offsets.at[list];
  uint end = push.offsets.at[list + 1u];
  for (uint i = first; i < end; ++i) {
    RenderSegment segment = push.segments.at[i];
    mask |= maskOf(segment.front, segment.back, push.nearest, push.binScale);
  }
  push.heads.at[list] = ListHead(first, end - first, mask);
}

// With the lists around it, which smooth reconstruction sees from within the tile.
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
  if (push.mode == expandModeSegments) {
    if (i < push.count) expandSegment(i);
  } else if (push.mode == expandModeMasks) {
    uint listCount = uint(push.lists.x) * uint(push.lists.y);
    if (i < listCount) maskList(i);
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
