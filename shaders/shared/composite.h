// Parameters of interleave.comp and composite.comp: the owner's side of compositing (paper, section 5.2).
#ifndef VDI_SHARED_COMPOSITE_H
#define VDI_SHARED_COMPOSITE_H
#include "lists.h"

VDI_SHARED_BEGIN

VDI_CONST uint compositeGroup = 64;
VDI_CONST uint interleaveModeCount = 0;     // counts[list] = sum over ranks
VDI_CONST uint interleaveModeWrite = 1;     // writes interleaved
VDI_CONST uint interleaveModeFlatten = 2;   // writes colors and depths, from interleaved
VDI_CONST uint compositeProgramSearch = 0;  // like castProgramSearch and the following
VDI_CONST uint compositeProgramCountPreSegments = 1;
VDI_CONST uint compositeProgramWritePreSegments = 2;
VDI_CONST uint compositeProgramHistogram = 3;
VDI_CONST uint compositeModeSearch = 0;
VDI_CONST uint compositeModeWrite = 1;

// A rank's position in a list.
struct InterleaveHead {
  uint next;
  uint end;
  vec2 depths;  // front and back of its next supersegment, comparable within the list
};

VDI_SHARED_END

#ifndef __cplusplus
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer InterleaveHeadArray {
  InterleaveHead at[];
};
#endif

VDI_SHARED_BEGIN

struct InterleaveConstants {
  VDI_ADDRESS(SegmentArray) received;      // all ranks' lists, one rank after the other
  // [ranks][rowLength], and a last entry: prefix sum over all of them
  VDI_ADDRESS(UintArray) subOffsets;
  VDI_ADDRESS(InterleaveHeadArray) heads;  // scratch, as many as received
  VDI_ADDRESS(UintArray) counts;           // [lists]
  VDI_ADDRESS(UintArray) offsets;          // [lists + 1]
  VDI_ADDRESS(SegmentArray) interleaved;   // ordered by depth within each list
  VDI_ADDRESS(Vec4Array) colors;           // [lists], premultiplied
  VDI_ADDRESS(FloatArray) depths;          // [lists]
  uint listCount;
  uint rankCount;
  uint rowLength;  // >= listCount
  uint mode;
  StoredForm form;  // the form of received and interleaved
};

struct CompositeParams {
  VDI_ADDRESS(SegmentArray) interleaved;
  VDI_ADDRESS(UintArray) interleavedOffsets;  // [lists + 1]
  VDI_ADDRESS(FloatArray) thresholds;
  VDI_ADDRESS(UintArray) capacities;
  VDI_ADDRESS(UintArray) offsets;
  VDI_ADDRESS(SegmentArray) segments;
  VDI_ADDRESS(PreSegmentArray) preSegments;
  VDI_ADDRESS(UintArray) written;
  VDI_ADDRESS(UintArray) left;
  VDI_ADDRESS(UintArray) status;
  VDI_ADDRESS(UintArray) histogram;
  VDI_ADDRESS(UintArray) guard;  // as in CastParams
  float step;  // step of the sample lattice
  uint budget;
  uint listCount;
  uint maxPerList;
  float level;  // as in CastParams
  StoredForm form;  // the form of interleaved and segments
};

struct CompositeConstants {
  uint mode;
};

VDI_SHARED_END

#endif
