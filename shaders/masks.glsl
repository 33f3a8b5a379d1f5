// Masks of the parts of the VDI's depth range; see shared/render.h.
#ifndef VDI_MASKS_GLSL
#define VDI_MASKS_GLSL
#include "shared/render.h"

int clampedBin(float bin) { return int(clamp(bin, 0.0, float(renderBins - 1))); }

// Monotone in depth, so that overlapping intervals share a bit.
int binOf(float depth, float nearest, float binScale) { return clampedBin((depth - nearest) * binScale); }

uint64_t maskOf(float front, float back, float nearest, float binScale) {
  return ((2ul << binOf(back, nearest, binScale)) - 1ul) & ~((1ul << binOf(front, nearest, binScale)) - 1ul);
}

// Whether a list may have material between two bins, given in any order.
bool mayMeet(uint64_t mask, vec2 bins) {
  const float spare = 0.01;  // for rounding
  int low = clampedBin(min(bins.x, bins.y) - spare);
  int high = clampedBin(max(bins.x, bins.y) + spare);
  uvec2 from = unpackUint2x32(mask >> low);
  int more = high - low;
  return ((more < 32 ? from.x : from.x | from.y) & (~0u >> (31 - min(more, 31)))) != 0u;
}

// Number of tiles of `size` x `size` lists.
ivec2 tilesOf(ivec2 lists, int size) { return (lists + size - 1) / size; }

#endif
