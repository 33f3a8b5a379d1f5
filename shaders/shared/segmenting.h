// Constants of how intervals become supersegments, and these become codes: of the reference, which says what they're
// for (vdi/reference/Segmenter.h, vdi/reference/Compaction.h), and of the shaders.
#ifndef VDI_SHARED_SEGMENTING_H
#define VDI_SHARED_SEGMENTING_H
#include "interop.h"

VDI_SHARED_BEGIN

VDI_CONST float maxOpticalDepth = 65504.0F;  // maxExtinction of core/TransferFunction.h

// Bisection.
VDI_CONST float smallestSensitivity = 1e-4F;
VDI_CONST float largestSensitivity = 2.0F;  // the norm of a difference of two vectors in [0, 1]^4
VDI_CONST int maxTries = 22;
VDI_CONST float goodFill = 0.85F;
VDI_CONST float closeBounds = 1.001F;

// Merging.
VDI_CONST float unlimited = 3.4e38F;  // a tolerance or cost
VDI_CONST int toleranceLevels = 8;
VDI_CONST float finestTolerance = 0.002F;
VDI_CONST float toleranceRatio = 4.0F;
VDI_CONST float hiddenWeight = 0.15F;
// Room for pre-segments, in multiples of a list's budget, and what's added to it.
VDI_CONST uint preSegmentsPerBudget = 2;
VDI_CONST uint sparePreSegments = 4;
VDI_CONST uint uncountedSparePreSegments = 8;  // and a quarter of the pre-segments
VDI_CONST uint countedStride = 4;
// A cumulative histogram: what all lists would hold at each level, then what they would equally; a pair of words each,
// the low one first. SupersegmentHistogram of core/Budget.h.
VDI_CONST uint histogramLevels = 10;

// Codes.
VDI_CONST float maxDepthCode = 16383.0F;
VDI_CONST float maxCarriedDepth = 1.0F / 16.0F;
VDI_CONST float maxDepthChange = 0.25F;  // of the supersegment's own
VDI_CONST float thinnestStep = 0.0002F;  // of opticalDepthOfCode
VDI_CONST float maxColorChange = 3.0F / 255.0F;
VDI_CONST float unseen = 1e-6F;

#ifdef __cplusplus
// Of a list that may hold `maximum` supersegments, where gaps don't require more.
constexpr uint64_t maxPreSegments(uint64_t maximum) {
  const uint64_t preSegments = preSegmentsPerBudget * maximum;
  return preSegments + preSegments / 4 + uncountedSparePreSegments;
}
// A ray that's counted for others takes one sample for this many: the more, the longer rays are for their lists' budget,
// for a device waits for the longest ray.
constexpr uint countedSamplesFor(uint lattice, uint budget) {
  const uint share = lattice / (16 * budget);
  return share < 1 ? 1 : share > 2 ? 2 : share;
}
#endif

VDI_SHARED_END

#endif
