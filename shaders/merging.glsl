// Merges two neighbouring pre-segments: the cost, and the result. Twin of vdi/reference/SegmentByMerging.cpp.
#ifndef VDI_MERGING_GLSL
#define VDI_MERGING_GLSL
#include "appearance.glsl"
#include "stored_pre_segment.glsl"

vec4 appearanceOf(StoredPreSegment preSegment, float sampleStep) {
  vec4 light = lightOf(preSegment);
  return appearanceOf(light.rgb, light.a, preSegment.span.y - preSegment.span.x, sampleStep);
}

float amountOf(StoredPreSegment preSegment, vec4 appearance) {
  return (preSegment.span.y - preSegment.span.x) * differenceOf(vec4(0.0), appearance);
}

// The place of the merged pre-segment: that of both, of the first, or of the second one.
const uint placeOfBoth = 0u;
const uint placeOfFirst = 1u;
const uint placeOfSecond = 2u;

// `x` and `y` are the appearances of a and b.
uint placeOf(StoredPreSegment a, vec4 x, StoredPreSegment b, vec4 y) {
  float lengths = (a.span.y - a.span.x) + (b.span.y - b.span.x);
  if (b.span.x - a.span.y < lengths * 0.9999) return placeOfBoth;
  if (amountOf(b, y) <= amountOf(a, x) * 1.0001) return placeOfFirst;
  return a.before < 1.0 ? placeOfSecond : placeOfBoth;
}

float costOf(StoredPreSegment a, vec4 x, StoredPreSegment b, vec4 y) {
  if (isCut(b)) return unlimited;
  float first = a.span.y - a.span.x;
  float second = b.span.y - b.span.x;
  float whole = b.span.y - a.span.x;
  float gap = b.span.x - a.span.y;
  float weight = weightBehind(a.before);
  // No product of two lengths is formed, because it may exceed a float's range.
  float perLength = 1.0 / whole;
  float shareOfFirst = first * perLength;
  // Without a gap, the formula at the end simplifies to this.
  if (!(gap > 0.0)) return 2.0 * weight * shareOfFirst * second * differenceOf(x, y);
  if (placeOf(a, x, b, y) != placeOfBoth) return 2.0 * weight * min(amountOf(a, x), amountOf(b, y));
  vec4 both = shareOfFirst * x + (second * perLength) * y;
  return weight * (first * differenceOf(x, both) + second * differenceOf(y, both) +
                   gap * differenceOf(vec4(0.0), both));
}

StoredPreSegment merged(StoredPreSegment a, vec4 x, StoredPreSegment b, vec4 y) {
  uint place = placeOf(a, x, b, y);
  vec4 light = lightOf(b);
  float opticalDepth = lightOf(a).a;
  a.light.rgb += (1.0 - opacityOf(opticalDepth)) * light.rgb;
  opticalDepth = min(opticalDepth + light.a, maxOpticalDepth);
  a.light.a = isCut(a) ? -opticalDepth : opticalDepth;
  if (place == placeOfSecond) a.span.x = b.span.x;
  if (place != placeOfFirst) a.span.y = b.span.y;
  return a;
}

// Whether the i-th merger is made in a round; `previous` and `next` are its neighbours' costs. Of equal
// costs, those at even places count as cheaper.
bool isCheapest(uint i, float previous, float cost, float next, float limit) {
  bool even = (i & 1u) == 0u;
  return cost < unlimited && cost <= limit && (even ? cost <= previous : cost < previous) &&
         (even ? cost <= next : cost < next);
}

// The limit for a round's mergers: the mean cost of the possible ones, rounded up so that equal costs do not
// exceed it.
float limitOf(float sum, float number) { return sum / number * 1.0001; }

#endif
