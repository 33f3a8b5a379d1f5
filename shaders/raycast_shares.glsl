// One brick's part of a ray, by all invocations that share the ray: each takes a sample, and they hand each other those that
// are visible. A ray then waits for memory once for all of their samples, and the time that a step takes is that of using what's
// visible.
//
// Needs: raycast.glsl; rayShares, rayShare.

// The ray's invocations where it's true, as bits.
uint sharesWhere(bool own) {
  uint shares = uint(own) << rayShare;
  for (uint step = 1u; step < rayShares; step *= 2u) shares |= subgroupShuffleXor(shares, step);
  return shares;
}

Sample sampleOfShare(Sample own, uint share) {
  uint from = gl_SubgroupInvocationID - rayShare + share;
  return Sample(subgroupShuffle(own.color, from), subgroupShuffle(own.opticalDepth, from), subgroupShuffle(own.opacity, from),
                subgroupShuffle(own.overStep, from));
}

// Samples [begin, end), as castSamples; transparent ones next to each other are used as one.
bool castShares(Brick brick, uint begin, uint end) {
  uint unused = usedFrom(begin);
  // Cells are asked for until one of them shows something, and again when no sample does.
  bool looking = true;
  for (uint batch = unused; batch < end; batch += rayShares * samplesAtOnce) {
    uint own = batch + rayShare * samplesAtOnce;
    bool mayShow = own < end;
    if (mayShow && looking) mayShow = showsAnything(brick, cellAround(brick, placeAmongCells(brick, own)));
    Sample mine = transparentSample;
    if (mayShow) {
      vec2 span = spanOf(own, own);
      float front = tablePosition(brick, beginOf(own));
      float back = tablePosition(brick, endOf(own));
      mine = sampleOf(slabOf(slabTexel(front, back), front, back), span.y - span.x);
    }
    uint visible = sharesWhere(mine.opticalDepth > 0.0);
    looking = visible == 0u;
    while (visible != 0u) {
      uint share = uint(findLSB(visible));
      visible &= visible - 1u;
      uint k = batch + share * samplesAtOnce;
      Sample it = sampleOfShare(mine, share);
      if (unused < k) {
        vec2 gap = spanOf(unused, k - samplesAtOnce);
        useSample(gap.x, gap.y, transparentSample);
      }
      vec2 span = spanOf(k, k);
      useSample(span.x, span.y, it);
      rayOpticalDepth += it.opticalDepth;
      if (rayOpticalDepth >= params.enough) return false;
      unused = k + samplesAtOnce;
    }
  }
  if (unused < end) {
    vec2 gap = spanOf(unused, (end - 1u) / samplesAtOnce * samplesAtOnce);
    useSample(gap.x, gap.y, transparentSample);
  }
  return true;
}
