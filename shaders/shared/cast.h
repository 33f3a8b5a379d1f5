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
#endif

VDI_SHARED_BEGIN

VDI_CONST uint castGroupX = 8;
VDI_CONST uint castGroupY = 8;
VDI_CONST uint castMaxPages = 8;
VDI_CONST uint castProgramVolume = 0;            // DVR: colours and depths
VDI_CONST uint castProgramSearch = 1;            // by bisection: one program that does both of the modes
VDI_CONST uint castProgramCountPreSegments = 2;  // by merging: tolerances and counts
VDI_CONST uint castProgramWritePreSegments = 3;
VDI_CONST uint castProgramHistogram = 4;    // for the total budget: what lists need
VDI_CONST uint castProgramCountLevels = 5;  // by merging, with other ranks: counts at all tolerances (quota.h)
VDI_CONST uint castMaxLights = 8;
VDI_CONST uint castMaxClipPlanes = 6;
// Differences between two values that are smaller than this share of them are taken for rounding (core/Shading.h).
VDI_CONST float leastGradient = 1.0e-6f;
VDI_CONST uint castModeSearch = 0;          // sensitivities and counts
VDI_CONST uint castModeWrite = 1;           // supersegments

struct CastParams {
  VDI_ADDRESS(BrickArray) bricks;
  VDI_ADDRESS(KdNodeArray) nodes;            // node 0 is the root
  VDI_ADDRESS(CellArray) cells;              // macrocells: 1 where something is visible
  VDI_ADDRESS(FloatArray) thresholds;        // [h][w]; by merging: tolerances, while counting those of the counted lists
  VDI_ADDRESS(UintArray) capacities;         // [h][w]; by merging: room for pre-segments, while counting the pre-segments of these
  VDI_ADDRESS(UintArray) offsets;            // [h][w], exclusive prefix sum of capacities
  VDI_ADDRESS(SegmentArray) segments;        // compact; by bisection
  VDI_ADDRESS(PreSegmentArray) preSegments;  // compact; by merging
  VDI_ADDRESS(UintArray) written;            // [h][w]: pre-segments
  VDI_ADDRESS(UintArray) left;               // [h][w]: how many are to be left of them
  VDI_ADDRESS(Vec4Array) colors;             // [h][w], premultiplied
  VDI_ADDRESS(FloatArray) depths;            // [h][w]
  VDI_ADDRESS(UintArray) status;             // [statusWords]
  VDI_ADDRESS(UintArray) histogram;          // [histogramLevels + 1][2]
  VDI_ADDRESS(UintArray) levels;             // [rows][countedWidth][countedLevelWords]
  VDI_ADDRESS(UintArray) quotas;             // [h][w]; with other ranks: as in InterpolateConstants
  VDI_ADDRESS(UintArray) guard;              // [1]: 0 if there's no room for the pre-segments that are to be written
  // Ray of pixel (x, y): start = startBase + u * startRight + v * startUp, direction likewise, with u = x + 0.5 - w/2 and
  // v = y + 0.5 - h/2. Start: at the front of the sample lattice, relative to the scene's centre.
  vec3 startBase;
  float step;  // depth between samples
  vec3 startRight;
  float first;  // depth of the lattice's front
  vec3 startUp;
  vec3 directionBase;
  float enough;  // optical depth at which a ray ends
  vec3 directionRight;
  float coordinateError;  // bound on the rounding error of a position
  vec3 directionUp;
  uint sampleCount;
  vec3 sceneLo;  // bounds of what is shown of all ranks' blocks, snapped as the bricks are
  vec3 sceneHi;
  uint budget;
  uint width;
  uint height;
  uint nodeCount;  // 0: no bricks
  // Of the table of slabs (core/SlabTable.h): what straight colours and optical depths are beyond the transfer table's range;
  // 1 / columns and rows; steps of its square a position; rows of a strip; its slabs a world length.
  vec4 slabBelow;
  vec4 slabAbove;
  vec2 perSlabTexels;
  float squarePerPosition;
  float stripRows;
  float slabsPerDepth;
  float lastPosition;  // of the transfer table
  uint slabs;      // 1: samples are classified by what lies between their two ends; 0: by their middle
  StoredForm form;  // of segments
  // While counting pre-segments: every countedStride-th list of every countedStride-th row, from the band's first row on, up to
  // and including the row behind the band, as [rows][countedWidth].
  uint countedStride;
  uint countedWidth;
  uint countedSamples;  // one sample stands for that many, those of a multiple of it
  uint maxPerList;
  float level;      // of the histogram; negative: equal budgets
  uint levelShift;  // of levels
  // Where colours are shaded (core/Shading.h): towards each light in world space, zero for one at the eye; its colour, times
  // diffuse.
  vec3 lightDirections[castMaxLights];
  vec3 lightColors[castMaxLights];
  uint lightCount;
  float ambient;
  vec4 clipPlanes[castMaxClipPlanes];  // what is shown has dot(xyz, position) >= w
  uint clipPlaneCount;
  uint shaded;  // 1: they are; a constant of the program
};

struct CastConstants {
  uint mode;
  uint firstRow;  // of the band of rows that this dispatch covers
  uint lastRow;
};

VDI_SHARED_END

#endif
