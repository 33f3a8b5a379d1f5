// Masks of the parts of the VDI's depth range; see shared/render.h.

// Monotone in depth, so that intervals that overlap share a bit.
int binOf(float depth, float nearest, float binScale) { return int(clamp((depth - nearest) * binScale, 0.0, float(renderBins - 1))); }

uint64_t maskOf(float front, float back, float nearest, float binScale) {
  return ((2ul << binOf(back, nearest, binScale)) - 1ul) & ~((1ul << binOf(front, nearest, binScale)) - 1ul);
}

// How many tiles of `size` x `size` lists there are.
ivec2 tilesOf(ivec2 lists, int size) { return (lists + size - 1) / size; }
