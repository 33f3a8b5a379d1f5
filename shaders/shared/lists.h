// Supersegments, and the pre-segments that they're merged from.
#ifndef VDI_SHARED_LISTS_H
#define VDI_SHARED_LISTS_H
#include "interop.h"
#include "segmenting.h"

VDI_SHARED_BEGIN

// What a rank tells the others of a list that it has counted, as bytes of these words, the first one lowest: visible samples,
// pre-segments at each tolerance, runs. Each is divided by 2^levelShift, rounded up, and 255 at most.
VDI_CONST uint countedLevelWords = 3;
VDI_CONST uint countedTolerance = 1;  // place of the finest tolerance's
VDI_CONST uint countedRuns = 9;

// What writing says of lists whose written count differs from the stored one, as words: how many there are, and with several
// ranks the most runs of any of them.
VDI_CONST uint statusWrongLists = 0;
VDI_CONST uint statusMostRuns = 1;
VDI_CONST uint statusWords = 2;

// Supersegment of core/Vdi.h.
struct Segment {
  float front;
  float back;
  float red;
  float green;
  float blue;
  float opacity;
};

// A pre-segment in memory: 32 bytes, so that it's a whole piece of a cache line where neighbouring invocations read
// different lists.
struct StoredPreSegment {
  vec2 span;     // front, back
  float before;  // transmittance of what's in front of it
  float unused;
  vec4 light;    // premultiplied colour over all of it, and optical depth: negative if it must not be merged with the one before it
};

// How supersegments lie in memory: as CompactSupersegment with this DepthCode of core/Supersegment.h, or, if the step is 0,
// as Segment. Shaders are specialised to one of the two (store.glsl).
struct StoredForm {
  float depthFirst;
  float depthStep;
};

#ifdef __cplusplus
inline uint isCompact(const StoredForm& form) { return form.depthStep > 0.0F ? 1 : 0; }
static_assert(sizeof(StoredPreSegment) == 32 && sizeof(Segment) == 24);  // as preSegmentsFrom and segmentsFrom count
#endif

VDI_SHARED_END

#ifndef __cplusplus
layout(buffer_reference, scalar, buffer_reference_align = 16) buffer PreSegmentArray { StoredPreSegment at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer SegmentArray { Segment at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer CompactArray { uvec2 at[]; };
struct FourCompact {
  uvec4 first;
  uvec4 second;
};
layout(buffer_reference, scalar, buffer_reference_align = 32) buffer FourCompactArray { FourCompact at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer UintArray { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer FloatArray { float at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) buffer Vec4Array { vec4 at[]; };

// Arrays may take more than 4 GiB. Where an index goes beyond them, a driver may compute its place in
// 32 bits: lists of an H200 came out wrong there. So a list's elements are counted from its first one.
PreSegmentArray preSegmentsFrom(PreSegmentArray all, uint first) { return PreSegmentArray(uint64_t(all) + 32ul * first); }
SegmentArray segmentsFrom(SegmentArray all, uint first) { return SegmentArray(uint64_t(all) + 24ul * first); }
#endif

#endif
