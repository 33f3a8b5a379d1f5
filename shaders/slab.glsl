// The material of a slab, the part of a ray that a sample represents, by one fetch from the table of slabs; or
// from pieces. Twin of vdi/core/SlabTable.cpp, whose header describes the layout.
//
// A part of raycast.glsl. The program provides params and slabs.
#ifndef VDI_SLAB_GLSL
#define VDI_SLAB_GLSL
#include "shared/cast.h"
#include "optical.glsl"

// The material of an interval of a ray.
struct Sample {
  vec3 color;  // straight
  float opticalDepth;
  float opacity;
  float overStep;  // opacity over the length of one step
};

const Sample transparentSample = Sample(vec3(0.0), 0.0, 0.0, 0.0);

Sample sampleOf(vec4 colorAndDepth, float length) {
  float opticalDepth =
      min(colorAndDepth.a * params.slabsPerDepth * rayLengthOfDepth * length, maxOpticalDepth);
  float opacity = opacityOf(opticalDepth);
  // Nearly all intervals are one sample long.
  float overStep = length == params.step ? opacity : opacityOf(opticalDepth * params.step / length);
  return Sample(colorAndDepth.rgb, opticalDepth, opacity, overStep);
}

// Properties of the blocks' values that need extra code: whether any are not finite, and whether any lie
// outside the transfer table's range.
layout(constant_id = 7) const bool mayBeInfinite = true;
layout(constant_id = 8) const bool reachesBeyond = true;
// Whether the transfer function is in pieces.
layout(constant_id = 12) const bool hasPieces = false;

#include "pieces.glsl"

// The code from here on selects with mix and has no branches, so that several fetches overlap. Pieces have.

bool isFinite(float value) { return !mayBeInfinite || abs(value) <= 3.0e38; }

// Premultiplied colour and opacity of the part of a slab between two positions within the transfer table; with
// pieces, straight colour and optical depth of the whole. A NaN at one end counts as the value at the other.
vec4 slabTexel(float front, float back) {
  float first = front;
  float last = back;
  if (mayBeInfinite) {
    first = mix(mix(0.0, back, isFinite(back)), front, isFinite(front));
    last = mix(first, back, isFinite(back));
  }
  if (hasPieces) return slabOfPieces(first, last);
  first = clamp(first, 0.0, params.lastPosition);
  last = clamp(last, 0.0, params.lastPosition);
  float span = abs(last - first);
  vec2 square = vec2(first, last) * params.squarePerPosition;
  float middle = 0.5 * (first + last);
  float row = min(floor(middle * (1.0 / float(slabStripStep))), params.stripRows - 1.0);
  float level = max(ceil(log2(span)), 0.0);
  vec2 strip = vec2(middle - row * float(slabStripStep), float(slabSide) + level * params.stripRows + row);
  bool isNear = span * params.squarePerPosition < 1.0;
  return textureLod(slabs, (mix(square, strip, bvec2(isNear)) + 0.5) * params.perSlabTexels, 0.0);
}

// Straight colour and optical depth of the whole slab; `texel` comes from slabTexel. A NaN at one end gives
// half of the material at the other.
vec4 slabOf(vec4 texel, float front, float back) {
  const float perLn2 = 1.44269504;
  bool isThin = texel.a < 1e-3;
  float depth =
      mix(-log2(1.0 - texel.a), texel.a * (1.0 + 0.5 * texel.a) * perLn2, isThin);  // opticalDepthOf
  vec4 slab = vec4(texel.rgb / max(texel.a, 1.0e-30), min(depth, maxOpticalDepth));
  if (hasPieces) slab = texel;
  if (reachesBeyond && !hasPieces) {
    // A part of the slab may lie beyond the table's ends.
    float low = min(front, back);
    float high = max(front, back);
    float span = high - low;
    float inside = min(high, params.lastPosition) - max(low, 0.0);
    vec3 depths = vec3(slab.a * inside, params.slabBelow.a * max(-low, 0.0),
                       params.slabAbove.a * max(high - params.lastPosition, 0.0)) / span;
    float sum = depths.x + depths.y + depths.z;
    vec3 color = depths.x * slab.rgb + depths.y * params.slabBelow.rgb + depths.z * params.slabAbove.rgb;
    bool isSome = inside > 0.0;
    bool isNotAll = inside < span;
    slab = mix(slab, vec4(color / max(sum, 1.0e-30), sum), bvec4(isSome && isNotAll));
  }
  if (mayBeInfinite) slab.a *= mix(0.0, 0.5, isFinite(front)) + mix(0.0, 0.5, isFinite(back));
  return slab;
}

#endif
