// Two neighbouring grains become one: what that costs, and what comes of it. Twin of vdi/reference/SegmentByMerging.cpp.
//
// Needs: optical.glsl, appearance.glsl, grain.glsl.

vec4 appearanceOf(StoredGrain grain, float sampleStep) {
  vec4 light = lightOf(grain);
  return appearanceOf(light.rgb, light.a, grain.span.y - grain.span.x, sampleStep);
}

// x, y: appearances of a and b.
float costOf(StoredGrain a, vec4 x, StoredGrain b, vec4 y) {
  if (isCut(b)) return unlimited;
  float first = a.span.y - a.span.x;
  float second = b.span.y - b.span.x;
  float whole = b.span.y - a.span.x;
  float gap = b.span.x - a.span.y;
  float weight = weightBehind(a.before) / whole;
  // What's below, where there's no gap.
  if (!(gap > 0.0)) return 2.0 * weight * first * second * differenceOf(x, y);
  vec4 both = first * x + second * y;
  return weight * (first * differenceOf(whole * x, both) + second * differenceOf(whole * y, both) +
                   gap * differenceOf(vec4(0.0), both));
}

StoredGrain merged(StoredGrain a, StoredGrain b) {
  vec4 light = lightOf(b);
  float opticalDepth = lightOf(a).a;
  a.light.rgb += (1.0 - opacityOf(opticalDepth)) * light.rgb;
  opticalDepth = min(opticalDepth + light.a, maxOpticalDepth);
  a.light.a = isCut(a) ? -opticalDepth : opticalDepth;
  a.span.y = b.span.y;
  return a;
}

// Whether the i-th merger is made in a round; its neighbours cost `previous` and `next`. Of equal costs those at even places are the
// cheaper ones.
bool isCheapest(uint i, float previous, float cost, float next, float limit) {
  bool even = (i & 1u) == 0u;
  return cost < unlimited && cost <= limit && (even ? cost <= previous : cost < previous) &&
         (even ? cost <= next : cost < next);
}

// What a round's mergers may cost: the mean of those that are possible, rounded up, so that that of equal ones isn't below them.
float limitOf(float sum, float number) { return sum / number * 1.0001; }
