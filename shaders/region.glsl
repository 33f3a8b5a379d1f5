// Clipping of a ray by planes. Twin of vdi/reference/Region.cpp; vdi/core/Region.h describes the planes.
//
// A part of raycast.glsl. The program provides params.
#ifndef VDI_REGION_GLSL
#define VDI_REGION_GLSL
#include "shared/cast.h"

// The part of [enter, leave], in depths from the lattice's front, on the visible sides of the planes. Depends
// only on the ray and the planes, so it is the same on every rank.
vec2 clipped(vec2 part) {
  for (uint i = 0u; i < params.clipPlaneCount; ++i) {
    vec4 plane = params.clipPlanes[i];
    precise float towards = dot(plane.xyz, rayDirection);
    precise float apart = plane.w - dot(plane.xyz, rayStart);
    if (towards > 0.0) part.x = max(part.x, apart / towards);
    if (towards < 0.0) part.y = min(part.y, apart / towards);
    if (towards == 0.0 && apart > 0.0) part.y = -1.0;
  }
  return part;
}

// The samples of [x, y) whose middle lies in the part.
uvec2 clippedSamples(uvec2 samples, vec2 part) {
  vec2 places = clamp(ceil(part / params.step - 0.5), vec2(0.0), vec2(params.sampleCount));
  uvec2 inside = uvec2(max(samples.x, uint(places.x)), min(samples.y, uint(places.y)));
  return inside.x < inside.y ? inside : uvec2(0u);
}

#endif
