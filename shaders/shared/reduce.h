// Parameters of long_lists.comp, reduce.comp, reduce_subgroup.comp and store.comp: turns pre-segments into
// supersegments.
#ifndef VDI_SHARED_REDUCE_H
#define VDI_SHARED_REDUCE_H
#include "lists.h"

VDI_SHARED_BEGIN

VDI_CONST uint longListsGroup = 256;
VDI_CONST uint reduceGroup = 64;
VDI_CONST uint storeGroup = 64;

struct ReduceConstants {
  VDI_ADDRESS(PreSegmentArray) preSegments;
  VDI_ADDRESS(UintArray) preSegmentOffsets;  // [lists + 1]
  VDI_ADDRESS(UintArray) written;            // [lists]: pre-segments
  VDI_ADDRESS(UintArray) left;               // [lists]: the number of pre-segments to keep
  VDI_ADDRESS(UintArray) offsets;            // [lists + 1], exclusive prefix sum of left
  VDI_ADDRESS(UintArray) longLists;          // [lists]: lists that subgroups reduce, in any order
  VDI_ADDRESS(UintArray) longListCount;      // [1]: their number
  VDI_ADDRESS(SegmentArray) segments;
  // Compositing: lists without pre-segments, which stay unchanged; else 0
  VDI_ADDRESS(SegmentArray) fitting;
  VDI_ADDRESS(UintArray) fittingOffsets;  // [lists + 1]: offsets of these
  // [1]: 0 if the supersegments do not fit, or the pre-segments are missing
  VDI_ADDRESS(UintArray) guard;
  float step;                             // step of the sample lattice
  uint listCount;
  uint subgroupCapacity;  // pre-segments of a list that fit a subgroup; 0: no subgroups
  StoredForm form;  // the form of segments
};

VDI_SHARED_END

#endif
