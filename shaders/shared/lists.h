// Supersegments, and the pre-segments from which they are merged.
#ifndef VDI_SHARED_LISTS_H
#define VDI_SHARED_LISTS_H
#include "interop.h"
#include "segmenting.h"

VDI_SHARED_BEGIN

// A rank's counts of a list, as bytes of these words, the first one lowest: visible samples, pre-segments at
// each tolerance, runs. Each is divided by 2^levelShift, rounded up, and 255 at most.
VDI_CONST uint countedLevelWords = 3;
VDI_CONST uint countedTolerance = 1;  // position of the finest tolerance's count
VDI_CONST uint countedRuns = 9;

// Words that report lists whose written count differs from the stored one: their number and, with several
// ranks, the most runs in any of them.
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

// A pre-segment in memory. Its 32 bytes are a whole sector of a cache line, because neighbouring invocations
// read different lists.
struct StoredPreSegment {
  vec2 span;     // front, back
  float before;  // transmittance in front of it
  float unused;
  // Premultiplied colour and optical depth of the whole pre-segment. The optical depth is negative if the
  // pre-segment must not merge with the previous one.
  vec4 light;
};

// Form of supersegments in memory: ListForm of core/Supersegment.h. Shaders are specialised to one encoding
// (store.glsl).
struct StoredForm {
  float depthFirst;  // the depth code's, else 0
  float depthStep;
  uint encoding;
};

#ifdef __cplusplus
// preSegmentsFrom and segmentsFrom use these sizes.
static_assert(sizeof(StoredPreSegment) == 32 && sizeof(Segment) == 24);
#endif

VDI_SHARED_END

#ifndef __cplusplus
layout(buffer_reference, scalar, buffer_reference_align = 16) buffer PreSegmentArray {
  StoredPreSegment at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer SegmentArray {
  Segment at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer CompactArray {
  uvec2 at[];
};
struct FourCompact {
  uvec4 first;
  uvec4 second;
};
layout(buffer_reference, scalar, buffer_reference_align = 32) buffer FourCompactArray {
  FourCompact at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer UintArray {
  uint at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer FloatArray {
  float at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 16) buffer Vec4Array {
  vec4 at[];
};

// Arrays may exceed 4 GiB. A driver may compute the position of a large index in 32 bits: an H200 gave wrong
// lists that way. So indices of a list's elements count from its first one.
PreSegmentArray preSegmentsFrom(PreSegmentArray all, uint first) {
  return PreSegmentArray(uint64_t(all) + 32ul * first);
}
SegmentArray segmentsFrom(SegmentArray all, uint first) {
  return SegmentArray(uint64_t(all) + 24ul * first);
}
UintArray uintsFrom(UintArray all, uint first) {
  return UintArray(uint64_t(all) + 4ul * first);
}
#endif

#endif
