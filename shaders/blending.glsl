// Blend modes other than composite (vdi/core/Blending.h). Twin of vdi/reference/Blending.cpp. The mode is a
// constant, so each mode costs nothing in the others' programs.
//
// A part of raycast.glsl. The program provides params.
#ifndef VDI_BLENDING_GLSL
#define VDI_BLENDING_GLSL
#include "shading.glsl"
#include "slab.glsl"

layout(constant_id = 10) const uint blendMode = blendComposite;
const bool projects = blendMode == blendMaximum || blendMode == blendMinimum;
const bool showsIsosurfaces = blendMode == blendIsosurface;

float beginOf(uint k);
float endOf(uint k);

// The extreme scalar so far, as a position in the transfer table, negated to find the smallest; and the depth
// at which it first occurs.
const float noExtreme = -3.402823466e38;
float extreme;
float extremeDepth;

float extremeOf(float position) { return blendMode == blendMinimum ? -position : position; }

void project(float position, float place) {
  float value = extremeOf(position);
  if (!(value > extreme)) return;  // NaN never is
  extreme = value;
  extremeDepth = params.first + place * params.step;
}

// An unsigned number that grows with the float.
uint orderedBits(float value) {
  uint bits = floatBitsToUint(value);
  return (bits >> 31) != 0u ? ~bits : bits | 0x80000000u;
}

// The extreme as a 64-bit number, low word first, whose maximum over ranks is the extreme of all ranks'
// scalars, and the nearest of equal ones; 0 without scalars. vdi/pipeline/Extremes.h reads it.
uvec2 extremeKey() {
  if (extreme == noExtreme) return uvec2(0u);
  return uvec2(~orderedBits(extremeDepth), orderedBits(extreme));
}

// Whether a macrocell whose texels have this range can add to the picture.
bool adds(Brick brick, vec2 range) {
  vec2 positions = (range - brick.tableOrigin) * brick.tableScale;
  if (projects) return max(extremeOf(positions.x), extremeOf(positions.y)) > extreme;
  const float spare = 0.01;
  for (uint i = 0u; i < params.isosurfaceCount; ++i) {
    float position = params.isosurfacePositions[i];
    if (positions.x - spare <= position && position <= positions.y + spare) return true;
  }
  return false;
}

// The isosurfaces that sample k crosses on its way between two positions in the transfer table, nearest
// first.
Sample crossed(Brick brick, uint k, float front, float back) {
  vec4 sum = vec4(0.0);
  for (uint i = 0u; i < params.isosurfaceCount; ++i) {
    uint nearest = front < back ? i : params.isosurfaceCount - 1u - i;
    float position = params.isosurfacePositions[nearest];
    bool crosses = (front < position && back >= position) || (front >= position && back < position);
    if (!crosses) continue;
    vec4 material = params.isosurfaceMaterials[nearest];
    float place = mix(beginOf(k), endOf(k), (position - front) / (back - front));
    if (colorCount > 0u) material.rgb = material.a * colorAt(brick, place);
    if (shaded) material.rgb *= lightAt(brick, place);
    sum += (1.0 - sum.a) * material;
  }
  return Sample(sum.rgb / max(sum.a, 1.0e-30), opticalDepthOf(sum.a), sum.a, sum.a);
}

#endif
