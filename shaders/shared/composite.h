// Parameters of interleave.comp and composite.comp: the owner's side of compositing (paper, section 5.2).
#ifndef VDI_SHARED_COMPOSITE_H
#define VDI_SHARED_COMPOSITE_H
#include "lists.h"

VDI_SHARED_BEGIN

VDI_CONST uint compositeGroup = 64;
VDI_CONST uint interleaveModeCount = 0;     // counts[list] = sum over ranks
VDI_CONST uint interleaveModeWrite = 1;     // writes interleaved
VDI_CONST uint interleaveModeFlatten = 2;   // writes colors and depths, of merged
VDI_CONST uint compositeProgramSearch = 0;  // as castProgramSearch and so on
VDI_CONST uint compositeProgramCountPreSegments = 1;
VDI_CONST uint compositeProgramWritePreSegments = 2;
VDI_CONST uint compositeProgramHistogram = 3;
VDI_CONST uint compositeModeSearch = 0;
VDI_CONST uint compositeModeWrite = 1;

// Where a rank's part of a list has got to.
struct InterleaveHead {
  uint next;
  uint end;
  vec2 depths;  // front and back of the next one, comparable within the list
};

VDI_SHARED_END

#ifndef __cplusplus
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer InterleaveHeadArray { InterleaveHead at[]; };
#endif

VDI_SHARED_BEGIN

struct InterleaveConstants {
  VDI_ADDRESS(SegmentArray) received;      // one rank's lists behind the other's
  VDI_ADDRESS(UintArray) subOffsets;       // [ranks][rowLength], and one more: a prefix sum of all of them
  VDI_ADDRESS(InterleaveHeadArray) heads;  // as many as received, scratch
  VDI_ADDRESS(UintArray) counts;           // [lists]
  VDI_ADDRESS(UintArray) offsets;          // [lists + 1]
  VDI_ADDRESS(SegmentArray) interleaved;   // ordered by depth within each list
  VDI_ADDRESS(Vec4Array) colors;           // [lists], premultiplied
  VDI_ADDRESS(FloatArray) depths;          // [lists]
  uint listCount;
  uint rankCount;
  uint rowLength;  // >= listCount
  uint mode;
  StoredForm form;  // of received and merged
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
  float step;  // of the sample lattice
  uint budget;
  uint listCount;
  uint maxPerList;
  float level;  // as in CastParams
  StoredForm form;  // of merged and segments
};

struct CompositeConstants {
  uint mode;
};

VDI_SHARED_END

#endif
