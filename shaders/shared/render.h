// Parameters of cull.comp and render.comp, which render a VDI from anywhere, and of expand.comp, which
// prepares it.
#ifndef VDI_SHARED_RENDER_H
#define VDI_SHARED_RENDER_H
#include "lists.h"

VDI_SHARED_BEGIN

VDI_CONST uint renderPictureTile = 8;  // pixels per side of a workgroup's tile
VDI_CONST uint renderRegion = 16;      // pixels per side of a packet to cull, a multiple of the tile
VDI_CONST uint renderCullGroup = 32;
VDI_CONST uint renderMaxGroups = 65535;  // the number that every device allows
VDI_CONST uint renderKinds = 24;         // classes of tiles, by their amount of work
// Assignment of a tile's pixels to neighbouring invocations: squares (along a Z), pairs of columns, or pairs
// of rows.
VDI_CONST uint renderOrderSquares = 0;
VDI_CONST uint renderOrderColumns = 1;
VDI_CONST uint renderOrderRows = 2;
// Form of the picture's colours: premultiplied floats; premultiplied bytes; straight bytes. Four per pixel.
VDI_CONST uint renderPictureFloats = 0;
VDI_CONST uint renderPictureBytes = 1;
VDI_CONST uint renderPictureStraightBytes = 2;
VDI_CONST uint expandGroup = 64;
VDI_CONST uint expandModeSegments = 0;    // one invocation per supersegment
VDI_CONST uint expandModeDepths = 1;      // one per list
VDI_CONST uint expandModeBins = 2;        // one invocation
VDI_CONST uint expandModeMasks = 3;       // one per list
VDI_CONST uint expandModeTiles = 4;       // one per tile
VDI_CONST uint expandModeLargeTiles = 5;  // one per large tile
VDI_CONST uint expandModeSlopes = 6;        // one per list, after the others
VDI_CONST uint expandModeLeaningMasks = 7;  // one per list; then the tiles again
// Reconstruction::Sheared (vdi/reference/Slopes.h).
VDI_CONST float renderMaxSlope = 8.0F;  // depth per list, in footprints: 83 degrees
VDI_CONST float renderSlopes = 127.0F;  // steps from 0 to renderMaxSlope
VDI_CONST int renderNoSlope = -128;     // during the search for slopes
VDI_CONST int renderOnFace = -128;      // in both slopes of a front or a back: it lies on a face of the box
VDI_CONST uint renderFaces = 6;         // number of a box's faces
VDI_CONST float renderMostDepth = 6.0F;      // optical depth that hides nearly all behind it
// Margin of comparisons, so that values that are equal but for rounding give the same decision everywhere.
VDI_CONST float renderTie = 1.0F / 64.0F;
VDI_CONST float renderLeastOpacity = 0.05F;  // over a footprint
VDI_CONST int renderTileShift = 3;
VDI_CONST int renderTile = 1 << renderTileShift;  // lists per side of a tile
VDI_CONST int renderLargeTile = 64;               // lists per side, a multiple of renderTile
VDI_CONST int renderMaxTiles = 4096;              // tiles of an axis (packet.glsl)
VDI_CONST int renderBins = 64;                    // parts of the depth range, and bits of a mask

// A supersegment in the form for rendering.
struct RenderSegment {
  float front;
  float back;
  float density;  // optical depth per depth, along its list
  uint color;     // straight; render_segment.glsl
};

// Depth range of all supersegments.
struct DepthRange {
  float nearest;   // > 0 in perspective; infinity without supersegments
  float farthest;  // 0 without supersegments
  float binScale;  // bins per unit of depth, 0 without a range
};

// The data of a list that a ray reads first: the position of its supersegments in the compact array, and its
// mask. `countAndReach` has the number of supersegments in its low listCountBits bits, and above them the
// reach of leaning faces beyond their depths in the list's middle, in units of listReachUnit slopes.
VDI_CONST uint listCountBits = 24;
VDI_CONST float listReachUnit = 2.0F;
struct ListHead {
  uint first;
  uint countAndReach;
  uint64_t mask;
};

// Numbers of tiles of the new picture to render, and the workgroups for them, which an indirect dispatch
// reads. The last workgroup empties the queue, so it is empty between views.
struct TileQueue {
  uvec3 groups;
  uint count;
  uint finished;             // workgroups that have finished
  uint counts[renderKinds];  // tiles of each class; the most work comes first
};

VDI_SHARED_END

#ifndef __cplusplus
layout(buffer_reference, scalar, buffer_reference_align = 16) buffer RenderSegmentArray {
  RenderSegment at[];
};
// RenderSegments as vectors, because a driver may read the members of a struct one by one.
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer RenderSegmentWords {
  uvec4 at[];
};
// Like preSegmentsFrom in lists.h.
RenderSegmentArray renderSegmentsFrom(RenderSegmentArray all, uint first) {
  return RenderSegmentArray(uint64_t(all) + 16ul * first);
}
RenderSegmentWords segmentWordsFrom(RenderSegmentWords all, uint first) {
  return RenderSegmentWords(uint64_t(all) + 16ul * first);
}
layout(buffer_reference, scalar, buffer_reference_align = 16) buffer ListHeads {
  ListHead at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 16) buffer TileQueueAddress {
  TileQueue at;
};
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer MaskArray {
  uint64_t at[];
};
#endif

VDI_SHARED_BEGIN

// core/BoxFaces.h: FaceTolerance.
struct FaceRounding {
  float depth;
  float distance;
};

// Data for skipping empty space. Bit b of a mask tells whether there is material in the b-th of renderBins
// equal parts of the VDI's depth range. There is a mask for each list, each tile of 8 x 8 lists, and each
// large tile of 64 x 64 lists.
struct ExpandConstants {
  VDI_ADDRESS(UintArray) offsets;            // [lists + 1]
  VDI_ADDRESS(SegmentArray) from;            // compact array, as stored; a part of the supersegments
  VDI_ADDRESS(RenderSegmentArray) segments;  // all; expandModeSegments: those made from `from`
  // [supersegments], four bytes each (render_segment.glsl); only for Reconstruction::Sheared
  VDI_ADDRESS(UintArray) slopes;
  VDI_ADDRESS(ListHeads) heads;              // [lists]
  VDI_ADDRESS(MaskArray) tileDepthMasks;     // [tiles.y][tiles.x], then [largeTiles.y][largeTiles.x]
  // a DepthRange; depths are not negative, so their bits compare as they do
  VDI_ADDRESS(UintArray) depthRange;
  VDI_ADDRESS(Vec4Array) boxFaces;  // [renderFaces], core/BoxFaces.h; for expandModeSlopes and LeaningMasks
  FaceRounding rounding;            // for lists that end on a face
  uint mode;
  uint count;        // supersegments in `from`
  uint perspective;  // projection of V_O
  float pixelSize;   // as in RenderParams
  ivec2 lists;
  StoredForm form;
};

VDI_CONST uint renderMaxClipPlanes = 6;

struct RenderParams {
  VDI_ADDRESS(ListHeads) heads;
  VDI_ADDRESS(RenderSegmentWords) segments;  // compact array
  VDI_ADDRESS(UintArray) slopes;             // in the order of segments
  VDI_ADDRESS(MaskArray) tileDepthMasks;
  VDI_ADDRESS(Vec4Array) colors;   // [height][width]; for bytes, a word each
  VDI_ADDRESS(FloatArray) depths;  // [height][width]
  // [height][width], if hasEnds: depths in the new view at which rays end
  VDI_ADDRESS(FloatArray) ends;
  VDI_ADDRESS(TileQueueAddress) queue;
  // [renderKinds][tiles]: the queue's tiles, as row * tiles in a row + column
  VDI_ADDRESS(UintArray) waiting;
  float nearest;  // depth range of the VDI, nearest > 0 in perspective
  float farthest;
  float pixelSize;  // view-space size of V_O's pixels, at depth 1 (perspective) or any depth (parallel)
  uint parallel;    // projection of V_O
  float slopeUnit;  // depth per list at a slope of 1
  uint width;       // of the picture, in pixels
  uint height;
  ivec2 lists;  // width and height of the VDI, in lists
  float binScale;
  uint hasEnds;
  uint clipPlaneCount;
  vec4 boxFaces[renderFaces];            // core/BoxFaces.h, for Reconstruction::Sheared; all 0: of all space
  vec4 clipPlanes[renderMaxClipPlanes];  // in V_O's view space; the visible side has dot(xyz, position) >= w
};

// Ray of the new view's pixel in V_O's view space, as in CastParams: base + u * right + v * up, where t is
// depth in the new view. Only these change while a user orbits.
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
