// Supersegments, and the grains that they're merged from.
#ifndef VDI_SHARED_LISTS_H
#define VDI_SHARED_LISTS_H
#include "interop.h"

VDI_SHARED_BEGIN

// Room for grains, in multiples of a list's budget; as in vdi/reference/Segmenter.h.
#ifdef __cplusplus
inline constexpr uint grainsPerBudget = 2;
#else
const uint grainsPerBudget = 2;
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

// How supersegments lie in memory: as CompactSupersegment with this DepthCode of core/Supersegment.h, or, if the step is 0,
// as Segment.
struct StoredForm {
  float depthFirst;
  float depthStep;
};

// Grain of vdi/reference/SegmentByMerging.cpp in memory. Its light, premultiplied colour over all of it and optical depth, is
// kept apart: it isn't needed to decide what's merged.
struct Grain {
  float front;
  float back;
  float before;  // transmittance of what's in front of it; -1 - that, if it must not be merged with the grain before it
  uint first;    // the first of the grains that it was merged from
  vec4 mean;     // premultiplied colour and opacity over one sample
};

VDI_SHARED_END

#ifndef __cplusplus
// Two vec4 a grain: one access each, where a struct's members would take eight.
layout(buffer_reference, scalar, buffer_reference_align = 16) buffer GrainArray { vec4 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer SegmentArray { Segment at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer CompactArray { uvec2 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer UintArray { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer UvecArray { uvec2 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer FloatArray { float at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) buffer Vec4Array { vec4 at[]; };
#endif

#endif
