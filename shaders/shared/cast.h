// Parameters of cast.comp: ray casting the blocks of a rank.
#ifndef VDI_SHARED_CAST_H
#define VDI_SHARED_CAST_H
#include "lists.h"
#include "cells.h"
#include "slab.h"
#include "volume.h"

#ifndef __cplusplus
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer BrickArray { Brick at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer KdNodeArray { KdNode at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer UintPairArray { uvec2 at[]; };
#endif

VDI_SHARED_BEGIN

VDI_CONST uint castGroupX = 8;
VDI_CONST uint castGroupY = 8;
VDI_CONST uint castMaxPages = 8;
VDI_CONST uint castProgramVolume = 0;            // DVR: colours and depths
VDI_CONST uint castProgramSearch = 1;            // bisection: one program for both modes
VDI_CONST uint castProgramCountPreSegments = 2;  // merging: tolerances and counts
VDI_CONST uint castProgramWritePreSegments = 3;
VDI_CONST uint castProgramHistogram = 4;    // total budget: the histogram of lists
VDI_CONST uint castProgramCountLevels = 5;  // merging with other ranks: counts at all tolerances (quota.h)
VDI_CONST uint castMaxLights = 8;
VDI_CONST uint castMaxClipPlanes = 6;
VDI_CONST uint castMaxIsosurfaces = 16;
// BlendMode (core/Blending.h), a constant of the program.
VDI_CONST uint blendComposite = 0;
VDI_CONST uint blendMaximum = 1;
VDI_CONST uint blendMinimum = 2;
VDI_CONST uint blendIsosurface = 3;
// A difference smaller than this share of two values counts as rounding error (core/Shading.h).
VDI_CONST float leastGradient = 1.0e-6f;
VDI_CONST uint castModeSearch = 0;          // sensitivities and counts
VDI_CONST uint castModeWrite = 1;           // supersegments

struct CastParams {
  VDI_ADDRESS(BrickArray) bricks;
  VDI_ADDRESS(KdNodeArray) nodes;            // node 0 is the root
  VDI_ADDRESS(CellArray) cells;              // macrocells: 1 if something in it is visible
  // [h][w]; merging: tolerances; while counting, of the counted lists
  VDI_ADDRESS(FloatArray) thresholds;
  // [h][w]; merging: room for pre-segments; while counting, their number in the counted lists
  VDI_ADDRESS(UintArray) capacities;
  VDI_ADDRESS(UintArray) offsets;            // [h][w], exclusive prefix sum of capacities
  VDI_ADDRESS(SegmentArray) segments;        // compact; bisection
  VDI_ADDRESS(PreSegmentArray) preSegments;  // compact; merging
  VDI_ADDRESS(UintArray) written;            // [h][w]: pre-segments
  VDI_ADDRESS(UintArray) left;               // [h][w]: the number of pre-segments to keep
  VDI_ADDRESS(Vec4Array) colors;             // [h][w], premultiplied
  VDI_ADDRESS(FloatArray) depths;            // [h][w]
  VDI_ADDRESS(UintPairArray) extremes;       // [h][w]: instead of colors and depths (blending.glsl)
  VDI_ADDRESS(CellRangeArray) ranges;        // macrocells' ranges (cells.h); unless blending is composite
  VDI_ADDRESS(UintArray) status;             // [statusWords]
  VDI_ADDRESS(UintArray) histogram;          // [histogramLevels + 1][2]
  VDI_ADDRESS(UintArray) levels;             // [rows][countedWidth][countedLevelWords]
  VDI_ADDRESS(UintArray) quotas;             // [h][w]; with other ranks: as in InterpolateConstants
  VDI_ADDRESS(SlabPieceArray) pieces;        // [pieceCount]; if the transfer function is in pieces
  VDI_ADDRESS(PieceStartArray) pieceStarts;  // [pieceCount]
  VDI_ADDRESS(UintArray) guard;              // [1]: 0 if there is no room for the pre-segments to write
  // The ray of pixel (x, y) has start = startBase + u * startRight + v * startUp, and its direction likewise,
  // with u = x + 0.5 - w/2 and v = y + 0.5 - h/2. It starts at the front of the sample lattice, relative to
  // the scene's centre.
  vec3 startBase;
  float step;  // depth between samples
  vec3 startRight;
  float first;  // depth of the lattice's front
  vec3 startUp;
  float reach;  // outermostReach
  vec3 directionBase;
  float terminationOpticalDepth;  // a ray ends there
  vec3 directionRight;
  float coordinateError;  // bound on the rounding error of a position
  vec3 directionUp;
  uint sampleCount;
  vec3 sceneLo;  // bounds of the visible part of all ranks' blocks, snapped as the bricks are
  vec3 sceneHi;
  uint budget;
  uint width;
  uint height;
  uint nodeCount;  // 0: no bricks
  // The table of slabs (core/SlabTable.h): straight colours and optical depths beyond the transfer table's
  // range; 1 / columns and 1 / rows; steps of its square per position; rows of a strip; slabs per world
  // length.
  vec4 slabBelow;
  vec4 slabAbove;
  vec2 perSlabTexels;
  float squarePerPosition;
  float stripRows;
  float slabsPerDepth;
  float lastPosition;  // last position in the transfer table
  uint pieceCount;     // 0: the transfer table has entries
  float slabLength;    // in unit distances
  // 1: samples are classified by the scalars at their two ends; 0: by the one in their middle
  uint slabs;
  StoredForm form;  // the form of segments
  // While counting pre-segments: every countedStride-th list of every countedStride-th row, from the band's
  // first row to the row after the band, as [rows][countedWidth].
  uint countedStride;
  uint countedWidth;
  uint countedSamples;  // one sample, at a multiple of this number, counts for that many
  uint maxPerList;
  float level;      // level of the histogram; negative: equal budgets
  uint levelShift;  // shift of the counts in levels
  // For shading (core/Shading.h): the direction towards each light in world space, zero for one at the eye;
  // its colour, times diffuse.
  vec3 lightDirections[castMaxLights];
  vec3 lightColors[castMaxLights];
  uint lightCount;
  float ambient;
  vec4 clipPlanes[castMaxClipPlanes];  // the visible side has dot(xyz, position) >= w
  uint clipPlaneCount;
  uint shaded;  // 1: colours are shaded; a constant of the program
  uint blendMode;
  VDI_ADDRESS(Vec4Array) colorNodes;  // red, green, blue, scalar; ascending; if blocks have one value for colours
  uint colorNodeCount;
  uint colorNodeStep;  // the largest power of 2 below their number
  uint takesNearest;  // 1: places have the values of the nearest texels; a constant of the program
  // Positions in the transfer table, ascending, and premultiplied colours and opacities.
  float isosurfacePositions[castMaxIsosurfaces];
  vec4 isosurfaceMaterials[castMaxIsosurfaces];
  uint isosurfaceCount;
};

struct CastConstants {
  uint mode;
  uint firstRow;  // first row of this dispatch's band
  uint lastRow;
};

VDI_SHARED_END

#endif
