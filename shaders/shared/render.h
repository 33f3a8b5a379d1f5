// Parameters of render.comp: a VDI seen from anywhere.
#ifndef VDI_SHARED_RENDER_H
#define VDI_SHARED_RENDER_H
#include "lists.h"

VDI_SHARED_BEGIN

#ifdef __cplusplus
inline constexpr uint renderGroupX = 8;
inline constexpr uint renderGroupY = 8;
#else
const uint renderGroupX = 8;
const uint renderGroupY = 8;
#endif

struct RenderParams {
  VDI_ADDRESS(UintArray) offsets;      // [lists + 1]
  VDI_ADDRESS(SegmentArray) segments;  // compact
  VDI_ADDRESS(Vec4Array) colors;       // [height][width]
  VDI_ADDRESS(FloatArray) depths;      // [height][width]
  // Ray of the new view's pixel in V_O's view space, as in CastParams: base + u * right + v * up, t = the new view's depth.
  vec3 originBase;
  float nearest;  // depth range of the VDI, nearest > 0 in perspective
  vec3 originRight;
  float farthest;
  vec3 originUp;
  float pixelSize;  // of V_O: view-space size of a pixel at depth 1 (perspective) or anywhere (parallel)
  vec3 directionBase;
  uint parallel;  // projection of V_O
  vec3 directionRight;
  uint width;  // of the picture
  vec3 directionUp;
  uint height;
  ivec2 lists;  // of the VDI: width, height
};

#ifndef __cplusplus
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer RenderParamsRef { RenderParams value; };
#endif

struct RenderConstants {
  VDI_ADDRESS(RenderParamsRef) params;
};

VDI_SHARED_END

#endif
