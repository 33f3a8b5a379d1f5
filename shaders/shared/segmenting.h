// Constants of segmenting and of depth codes, shared by shaders and reference. vdi/reference/Segmenter.h and
// vdi/reference/Compaction.h explain them.
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
// Room for pre-segments, in multiples of a list's budget, and the spare room that is added.
VDI_CONST uint preSegmentsPerBudget = 2;
VDI_CONST uint sparePreSegments = 4;
VDI_CONST uint uncountedSparePreSegments = 8;  // plus a quarter of the pre-segments
VDI_CONST uint countedStride = 4;
// Cumulative histogram: the supersegments of all lists at each level, then those with equal budgets. Each is
// a pair of words, the low one first. SupersegmentHistogram of core/Budget.h.
VDI_CONST uint histogramLevels = 10;

// Codes.
VDI_CONST float maxDepthCode = 16383.0F;
VDI_CONST float maxCarriedDepth = 1.0F / 16.0F;
VDI_CONST float maxDepthChange = 0.25F;  // share of the supersegment's own optical depth
VDI_CONST float thinnestStep = 0.0002F;  // least step of opticalDepthOfCode
VDI_CONST float maxColorChange = 3.0F / 255.0F;
VDI_CONST float unseen = 1e-6F;

#ifdef __cplusplus
// The most pre-segments of a list that may hold `maximum` supersegments, unless gaps require more.
constexpr uint64_t maxPreSegments(uint64_t maximum) {
  const uint64_t preSegments = preSegmentsPerBudget * maximum;
  return preSegments + preSegments / 4 + uncountedSparePreSegments;
}
// Number of samples that each sample of a counted ray represents. It grows with the rays' length relative to
// their lists' budget, because a device waits for the longest ray.
constexpr uint countedSamplesFor(uint lattice, uint budget) {
  const uint share = lattice / (16 * budget);
  return share < 1 ? 1 : share > 2 ? 2 : share;
}
#endif

VDI_SHARED_END

#endif
