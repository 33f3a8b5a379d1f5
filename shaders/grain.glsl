// A grain in memory: 16 bytes, one access. Front and back; premultiplied colour over all of it and optical depth as half
// floats, whose sign tells that it must not be merged with the grain before it. Twin of Grain::round in
// vdi/reference/SegmentByMerging.cpp.

const float grainDepthScale = 64.0;             // optical depths from
const float thinnestGrain = 9.5367431640625e-7;  // 2^-20, to
const float thickestGrain = 1023.0;             // are normal half floats then

uvec4 packedGrain(vec2 span, vec4 light, bool cut) {
  float depth = clamp(light.a, thinnestGrain, thickestGrain) * grainDepthScale;
  return uvec4(floatBitsToUint(span), packHalf2x16(light.rg), packHalf2x16(vec2(light.b, depth)) | (cut ? 0x80000000u : 0u));
}

vec2 spanOf(uvec4 grain) { return uintBitsToFloat(grain.xy); }

vec4 lightOf(uvec4 grain) {
  vec2 blueDepth = unpackHalf2x16(grain.w & 0x7fffffffu);
  return vec4(unpackHalf2x16(grain.z), blueDepth.x, blueDepth.y * (1.0 / grainDepthScale));
}

bool isCut(uvec4 grain) { return (grain.w & 0x80000000u) != 0u; }
