// Parameters of long_lists.comp, reduce.comp, reduce_subgroup.comp and store.comp: what becomes of pre-segments.
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
  VDI_ADDRESS(UintArray) left;               // [lists]: how many are to be left of them
  VDI_ADDRESS(UintArray) offsets;            // [lists + 1], exclusive prefix sum of left
  VDI_ADDRESS(UintArray) longLists;          // [lists]: those that subgroups reduce, in any order
  VDI_ADDRESS(UintArray) longListCount;      // [1]: how many
  VDI_ADDRESS(SegmentArray) segments;
  VDI_ADDRESS(SegmentArray) fitting;      // compositing: lists that are left as they are, those that have no pre-segments; else 0
  VDI_ADDRESS(UintArray) fittingOffsets;  // [lists + 1]: where they are
  VDI_ADDRESS(UintArray) guard;           // [1]: 0 if there's no room for what's left, or the pre-segments aren't there
  float step;                             // of the sample lattice
  uint listCount;
  uint subgroupCapacity;  // pre-segments of a list that a subgroup has room for; 0: there are no subgroups
  uint pad;
  StoredForm form;  // of segments
};

VDI_SHARED_END

#endif
