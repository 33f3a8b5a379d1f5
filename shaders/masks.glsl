// Masks of the parts of the VDI's depth range; see shared/render.h.

// Monotone in depth, so that intervals that overlap share a bit.
int binOf(float depth, float nearest, float binScale) { return clamp(int((depth - nearest) * binScale), 0, 31); }

uint maskOf(float front, float back, float nearest, float binScale) {
  return ((2u << binOf(back, nearest, binScale)) - 1u) & ~((1u << binOf(front, nearest, binScale)) - 1u);
}
