// A rank's blocks on the device, as vdi/gpu/VolumeStore lays them out.
#ifndef VDI_SHARED_VOLUME_H
#define VDI_SHARED_VOLUME_H
#include "interop.h"

VDI_SHARED_BEGIN

// Texels per side of a macrocell (cells.comp).
VDI_CONST uint cellSide = 16;

// The greatest depth of a kd-tree over bricks that fits the stack of cast.comp.
VDI_CONST int kdMaxDepth = 40;

// A box of samples in one piece of one texture page. Positions are relative to the scene's centre, snapped to
// the scene's lattice (core/Scene.h).
struct Brick {
  vec3 lo;           // owned, half-open
  float tableScale;  // table position = (texel value - tableOrigin) * tableScale
  vec3 hi;
  float tableOrigin;
  vec3 texelScale;  // normalised texture coordinate = position * texelScale + texelOffset
  uint page;
  vec3 texelOffset;
  uint piece;  // index in vdi/gpu/VolumeStore; shaders do not read it
  vec3 texelLo;  // centre of the first texels (lo) and last ones (hi): coordinates are clamped to them
  uint firstCell;  // first of its piece's macrocells
  vec3 texelHi;
  uint pad0;
  vec3 cellScale;  // position among the piece's macrocells = texture coordinate * cellScale + cellOffset
  uint pad1;
  vec3 cellOffset;
  uint pad2;
  uvec3 cellDims;
  uint pad3;
  vec3 colorScale;  // colour = texel value of a page of colours * colorScale + colorOffset
  uint pad4;
  vec3 colorOffset;
  uint pad5;
};

// Node of a kd-tree over bricks. Inner node: samples with p[axis] < split lie in child `first`, the others in
// `first + 1`. Leaf: axis == 3, bricks [first, first + count); count is 0 or 1.
struct KdNode {
  float split;
  uint axis;
  uint first;
  uint count;
};

VDI_SHARED_END

#endif
