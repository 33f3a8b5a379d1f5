// Supersegments, and the grains that they're merged from.
#ifndef VDI_SHARED_LISTS_H
#define VDI_SHARED_LISTS_H
#include "interop.h"

VDI_SHARED_BEGIN

// Room for grains, in multiples of a list's budget, and what's added to it; as in vdi/reference/Segmenter.h.
#ifdef __cplusplus
inline constexpr uint grainsPerBudget = 2;
inline constexpr uint spareGrains = 4;
inline constexpr uint uncountedSpareGrains = 8;
inline constexpr uint countedStride = 4;
inline uint countedSamplesFor(uint lattice, uint budget) {
  const uint share = lattice / (16 * budget);
  return share < 1 ? 1 : share > 2 ? 2 : share;
}
#else
const uint grainsPerBudget = 2;
const uint spareGrains = 4;
const uint uncountedSpareGrains = 8;
const uint countedStride = 4;
#endif

// A survey: what all lists would hold at each level, then what they would equally; a pair of words each, the low one first.
// Survey of core/Budget.h.
#ifdef __cplusplus
inline constexpr uint surveyLevels = 10;
#else
const uint surveyLevels = 10;
#endif

// Supersegment of core/Vdi.h.
struct Segment {
  float front;
  float back;
  float red;
  float green;
  float blue;
  float opacity;
};

// A grain in memory: front and back; premultiplied colour over all of it and optical depth, which is negative if the grain must
// not be merged with the one before it. In 32 bytes, though 24 would do: neighbouring invocations read different lists, and a
// grain is a whole piece of a cache line then (merging takes 0.75 of the time on an H200).
struct StoredGrain {
  vec2 span;
  vec2 unused;
  vec4 light;
};

// How supersegments lie in memory: as CompactSupersegment with this DepthCode of core/Supersegment.h, or, if the step is 0,
// as Segment. Shaders are specialised to one of the two (store.glsl).
struct StoredForm {
  float depthFirst;
  float depthStep;
};

#ifdef __cplusplus
inline uint isCompact(const StoredForm& form) { return form.depthStep > 0.0F ? 1 : 0; }
#endif

VDI_SHARED_END

#ifndef __cplusplus
layout(buffer_reference, scalar, buffer_reference_align = 16) buffer GrainArray { StoredGrain at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer SegmentArray { Segment at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer CompactArray { uvec2 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer UintArray { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer FloatArray { float at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) buffer Vec4Array { vec4 at[]; };
#endif

#endif
