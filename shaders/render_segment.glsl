// Supersegments as render.comp reads them: the words of RenderSegment.
#ifndef VDI_RENDER_SEGMENT_GLSL
#define VDI_RENDER_SEGMENT_GLSL
#include "shared/render.h"
#include "exact.glsl"

// Straight colour in 11, 11 and 10 bits; multiples of the 8-bit colours of codes, which stay exact.
const uvec3 maxSegmentColor = uvec3(2040u, 2040u, 1020u);

uint packedSegmentColor(vec3 straight) {
  uvec3 codes = uvec3(round(clamp(straight, 0.0, 1.0) * vec3(maxSegmentColor)));
  return codes.r | codes.g << 11 | codes.b << 22;
}

// Converts to units of segmentColorUnit; green keeps its shifted position.
const vec3 segmentColorUnit = 1.0 / (vec3(maxSegmentColor) * vec3(1.0, 2048.0, 1.0));

vec3 segmentColor(uvec4 segment) {
  return vec3(exactFloat(segment.w & 0x7ffu), exactFloat(segment.w & 0x3ff800u), exactFloat(segment.w >> 22));
}

float segmentDensity(uvec4 segment) { return uintBitsToFloat(segment.z); }

// Front and back.
vec2 segmentDepths(uvec4 segment) { return uintBitsToFloat(segment.xy); }

uint segmentCount(ListHead head) { return head.countAndReach & ((1u << listCountBits) - 1u); }

// Slopes of front and back, along x and y each (vdi/reference/Slopes.h).
vec4 segmentSlopes(uint word) {
  int bits = int(word);
  return vec4(bitfieldExtract(bits, 0, 8), bitfieldExtract(bits, 8, 8), bitfieldExtract(bits, 16, 8),
              bitfieldExtract(bits, 24, 8));
}

bool frontIsOnFace(vec4 slopes) { return slopes.x == float(renderOnFace) && slopes.y == float(renderOnFace); }
bool backIsOnFace(vec4 slopes) { return slopes.z == float(renderOnFace) && slopes.w == float(renderOnFace); }

#endif
