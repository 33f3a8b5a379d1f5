// Parameters of cull.comp and render.comp: a VDI seen from anywhere. And of expand.comp, which prepares it.
#ifndef VDI_SHARED_RENDER_H
#define VDI_SHARED_RENDER_H
#include "lists.h"

VDI_SHARED_BEGIN

VDI_CONST uint renderPictureTile = 8;  // pixels per side of what a workgroup renders
VDI_CONST uint renderRegion = 16;      // of the packet that says whether there's anything to render: a multiple of that
VDI_CONST uint renderCullGroup = 32;
VDI_CONST uint renderMaxGroups = 65535;  // every device allows them
VDI_CONST uint renderKinds = 24;         // of tiles, by how much there is to look at
// Of a tile's pixels: neighbouring invocations have squares of them (along a Z), or pairs of columns, or pairs of rows.
VDI_CONST uint renderOrderSquares = 0;
VDI_CONST uint renderOrderColumns = 1;
VDI_CONST uint renderOrderRows = 2;
// Of its colours: premultiplied, four floats; premultiplied, straight, four bytes.
VDI_CONST uint renderPictureFloats = 0;
VDI_CONST uint renderPictureBytes = 1;
VDI_CONST uint renderPictureStraightBytes = 2;
VDI_CONST uint expandGroup = 64;
VDI_CONST uint expandModeSegments = 0;    // one invocation a supersegment
VDI_CONST uint expandModeDepths = 1;      // one a list
VDI_CONST uint expandModeBins = 2;        // one
VDI_CONST uint expandModeMasks = 3;       // one a list
VDI_CONST uint expandModeTiles = 4;       // one a tile
VDI_CONST uint expandModeLargeTiles = 5;  // one a large tile
VDI_CONST int renderTileShift = 3;
VDI_CONST int renderTile = 1 << renderTileShift;  // lists per side of a tile
VDI_CONST int renderLargeTile = 64;               // a multiple of that
VDI_CONST int renderMaxTiles = 4096;              // tiles of an axis (packet.glsl)
VDI_CONST int renderBins = 64;                    // parts of the depth range: bits of a mask

// A supersegment as rendering wants it.
struct RenderSegment {
  float front;
  float back;
  float density;  // optical depth per depth, along its list
  uint color;     // straight; render_segment.glsl
};

// Of all supersegments.
struct DepthRange {
  float nearest;   // > 0 in perspective; infinity where there's nothing
  float farthest;  // 0 where there's nothing
  float binScale;  // bins per unit of depth, 0 without a range
};

// What a ray asks of each list that it crosses: its supersegments in the compact array, and its mask.
struct ListHead {
  uint first;
  uint count;
  uint64_t mask;
};

// How many tiles of the new picture are to be rendered, and the workgroups for that: what an indirect dispatch reads. Empty between
// views: the last workgroup leaves it so.
struct TileQueue {
  uvec3 groups;
  uint count;
  uint finished;             // workgroups
  uint counts[renderKinds];  // of each kind; first those with most to look at
};

VDI_SHARED_END

#ifndef __cplusplus
layout(buffer_reference, scalar, buffer_reference_align = 16) buffer RenderSegmentArray { RenderSegment at[]; };
// RenderSegments as render.comp reads them: at once; TableArray in cast.h says why.
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer RenderSegmentWords { uvec4 at[]; };
// As those of lists.h.
RenderSegmentArray renderSegmentsFrom(RenderSegmentArray all, uint first) {
  return RenderSegmentArray(uint64_t(all) + 16ul * first);
}
RenderSegmentWords segmentWordsFrom(RenderSegmentWords all, uint first) {
  return RenderSegmentWords(uint64_t(all) + 16ul * first);
}
layout(buffer_reference, scalar, buffer_reference_align = 16) buffer ListHeads { ListHead at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) buffer TileQueueAddress { TileQueue at; };
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer MaskArray { uint64_t at[]; };
#endif

VDI_SHARED_BEGIN

// What's where, for skipping empty space: bit b of a mask tells whether there is material in the b-th of renderBins equal parts of
// the VDI's depth range; a mask a list, one a tile of 8 x 8 lists, and one a large
// tile of 64 x 64.
struct ExpandConstants {
  VDI_ADDRESS(UintArray) offsets;            // [lists + 1]
  VDI_ADDRESS(SegmentArray) from;            // compact array, as stored: a part of the supersegments
  VDI_ADDRESS(RenderSegmentArray) segments;  // all; expandModeSegments: those that come from `from`
  VDI_ADDRESS(ListHeads) heads;              // [lists]
  VDI_ADDRESS(MaskArray) tileDepthMasks;     // [tiles.y][tiles.x], then [largeTiles.y][largeTiles.x]
  VDI_ADDRESS(UintArray) depthRange;         // a DepthRange; depths aren't negative, so bits compare as they do
  uint mode;
  uint count;        // supersegments of `from`
  uint perspective;  // projection of V_O
  ivec2 lists;
  StoredForm form;
};

VDI_CONST uint renderMaxClipPlanes = 6;

struct RenderParams {
  VDI_ADDRESS(ListHeads) heads;
  VDI_ADDRESS(RenderSegmentWords) segments;  // compact array
  VDI_ADDRESS(MaskArray) tileDepthMasks;
  VDI_ADDRESS(Vec4Array) colors;       // [height][width]; bytes: a word each
  VDI_ADDRESS(FloatArray) depths;      // [height][width]
  VDI_ADDRESS(FloatArray) ends;        // [height][width], if hasEnds: the new view's depths at which rays end
  VDI_ADDRESS(TileQueueAddress) queue;
  VDI_ADDRESS(UintArray) waiting;  // [renderKinds][tiles]: the tiles of the queue, as row * tiles in a row + column
  float nearest;  // depth range of the VDI, nearest > 0 in perspective
  float farthest;
  float pixelSize;  // of V_O: view-space size of a pixel at depth 1 (perspective) or anywhere (parallel)
  uint parallel;    // projection of V_O
  uint width;       // of the picture
  uint height;
  ivec2 lists;  // of the VDI: width, height
  float binScale;
  uint hasEnds;
  uint clipPlaneCount;
  vec4 clipPlanes[renderMaxClipPlanes];  // in V_O's view space; what is shown has dot(xyz, position) >= w
};

// Ray of the new view's pixel in V_O's view space, as in CastParams: base + u * right + v * up, t = the new view's depth. All that
// changes while someone orbits.
struct RenderRays {
  vec3 originBase;
  vec3 originRight;
  vec3 originUp;
  vec3 directionBase;
  vec3 directionRight;
  vec3 directionUp;
};

VDI_SHARED_END

#endif
