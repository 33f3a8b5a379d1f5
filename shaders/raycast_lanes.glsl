// One brick's part of a ray, handled by all invocations that share the ray: each takes a sample, and they
// exchange the visible ones. A ray then waits for memory once for all of their samples, and a step's time is
// that of using the visible samples.
//
// A part of raycast.glsl. The program provides lanesPerRay and rayLane.
#ifndef VDI_RAYCAST_LANES_GLSL
#define VDI_RAYCAST_LANES_GLSL

// Bits of the ray's invocations for which `own` is true.
uint lanesWhere(bool own) {
  uint lanes = uint(own) << rayLane;
  for (uint step = 1u; step < lanesPerRay; step *= 2u) lanes |= subgroupShuffleXor(lanes, step);
  return lanes;
}

Sample sampleOfLane(Sample own, uint lane) {
  uint from = gl_SubgroupInvocationID - rayLane + lane;
  return Sample(subgroupShuffle(own.color, from), subgroupShuffle(own.opticalDepth, from),
                subgroupShuffle(own.opacity, from), subgroupShuffle(own.overStep, from));
}

// Uses samples [begin, end) as castSamples does; adjacent transparent ones count as one.
bool castLanes(Brick brick, uint begin, uint end) {
  uint unused = usedFrom(begin);
  // Cells are read until one of them has something visible, and again when no sample has.
  bool looking = true;
  for (uint batch = unused; batch < end; batch += lanesPerRay * samplesAtOnce) {
    uint own = batch + rayLane * samplesAtOnce;
    bool mayShow = own < end;
    if (mayShow && looking) mayShow = showsAnything(brick, cellAround(brick, placeAmongCells(brick, own)));
    Sample mine = transparentSample;
    if (mayShow) {
      vec2 span = spanOf(own, own);
      if (takesNearest) {
        mine = nearestSample(brick, own, span.y - span.x);
      } else {
        float front = tablePosition(brick, beginOf(own));
        float back = tablePosition(brick, endOf(own));
        vec4 slab = slabOf(slabTexel(front, back), front, back);
        mine = lit(brick, middleOf(own), sampleOf(slab, span.y - span.x));
      }
    }
    uint visible = lanesWhere(mine.opticalDepth > 0.0);
    looking = visible == 0u;
    while (visible != 0u) {
      uint lane = uint(findLSB(visible));
      visible &= visible - 1u;
      uint k = batch + lane * samplesAtOnce;
      Sample it = sampleOfLane(mine, lane);
      if (unused < k) {
        vec2 gap = spanOf(unused, k - samplesAtOnce);
        useSample(gap.x, gap.y, transparentSample);
      }
      vec2 span = spanOf(k, k);
      useSample(span.x, span.y, it);
      rayOpticalDepth += it.opticalDepth;
      if (rayOpticalDepth >= params.terminationOpticalDepth) return false;
      unused = k + samplesAtOnce;
    }
  }
  if (unused < end) {
    vec2 gap = spanOf(unused, (end - 1u) / samplesAtOnce * samplesAtOnce);
    useSample(gap.x, gap.y, transparentSample);
  }
  return true;
}

#endif
