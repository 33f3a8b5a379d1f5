// The light on a sample. Twin of vdi/reference/Shading.cpp; vdi/core/Shading.h has the formula.
//
// A part of raycast.glsl. The program provides params.
#ifndef VDI_SHADING_GLSL
#define VDI_SHADING_GLSL
#include "shared/cast.h"

// Whether colours are shaded; without shading its code costs nothing.
layout(constant_id = 9) const bool shaded = false;

// The difference; zero if it counts as rounding, if a value is not finite, or if the difference or its
// reciprocal is not a normal float: devices divide by such numbers as by zero or infinity.
float differenceOf(float ahead, float behind) {
  float difference = ahead - behind;
  float least = max(leastGradient * (abs(ahead) + abs(behind)), 1.2e-38);
  return abs(difference) > least && abs(difference) <= 8.0e37 ? difference : 0.0;
}

// Direction of the scalar's gradient at a place of the ray, by central differences over a voxel on each side;
// zero if there is no gradient. Texels are values times a positive scale, which does not matter here.
vec3 normalAt(Brick brick, float place) {
  vec3 middle = positionAt(place) * brick.texelScale + brick.texelOffset;
  vec3 texels = pageSize(brick);
  vec3 voxel = 1.0 / texels;
  vec3 ahead = clamp(middle + voxel, brick.texelLo, brick.texelHi);
  vec3 behind = clamp(middle - voxel, brick.texelLo, brick.texelHi);
  vec3 here = clamp(middle, brick.texelLo, brick.texelHi);
  float x0 = texel(brick.page, vec3(behind.x, here.yz));
  float x1 = texel(brick.page, vec3(ahead.x, here.yz));
  float y0 = texel(brick.page, vec3(here.x, behind.y, here.z));
  float y1 = texel(brick.page, vec3(here.x, ahead.y, here.z));
  float z0 = texel(brick.page, vec3(here.xy, behind.z));
  float z1 = texel(brick.page, vec3(here.xy, ahead.z));
  vec3 differences = vec3(differenceOf(x1, x0), differenceOf(y1, y0), differenceOf(z1, z0));
  float greatest = max(max(abs(differences.x), abs(differences.y)), abs(differences.z));
  if (!(greatest > 0.0)) return vec3(0.0);
  // texels * texelScale is 1 / spacing. Divides by the largest component before lengths are squared, because
  // values may have any magnitude.
  vec3 gradient = differences / greatest * texels * brick.texelScale;
  float largest = max(max(abs(gradient.x), abs(gradient.y)), abs(gradient.z));
  return normalize(gradient / largest);
}

vec3 lightAt(Brick brick, float place) {
  vec3 normal = normalAt(brick, place);
  vec3 toEye = -rayDirection / rayLengthOfDepth;
  vec3 light = vec3(params.ambient);
  for (uint i = 0u; i < params.lightCount; ++i) {
    vec3 direction = params.lightDirections[i];
    bool atEye = all(equal(direction, vec3(0.0)));
    light += params.lightColors[i] * abs(dot(normal, mix(direction, toEye, bvec3(atEye))));
  }
  return light;
}

// A sample, or a part of one, with the colour and under the light of its middle.
Sample lit(Brick brick, float middle, Sample it) {
  it = colored(brick, middle, it);
  if (shaded && it.opticalDepth > 0.0) it.color *= lightAt(brick, middle);
  return it;
}

#endif
