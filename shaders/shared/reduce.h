// Parameters of queue.comp, reduce.comp, reduce_team.comp and store.comp: what becomes of grains.
#ifndef VDI_SHARED_REDUCE_H
#define VDI_SHARED_REDUCE_H
#include "lists.h"

VDI_SHARED_BEGIN

VDI_CONST uint queueGroup = 256;
VDI_CONST uint reduceGroup = 64;
VDI_CONST uint storeGroup = 64;

struct ReduceConstants {
  VDI_ADDRESS(GrainArray) grains;
  VDI_ADDRESS(UintArray) grainOffsets;  // [lists + 1]
  VDI_ADDRESS(UintArray) written;       // [lists]: grains
  VDI_ADDRESS(UintArray) left;          // [lists]: how many are to be left of them
  VDI_ADDRESS(UintArray) offsets;       // [lists + 1], exclusive prefix sum of left
  VDI_ADDRESS(UintArray) queue;         // [lists]: those that teams reduce, in any order
  VDI_ADDRESS(UintArray) queued;        // [1]: how many
  VDI_ADDRESS(SegmentArray) segments;
  VDI_ADDRESS(SegmentArray) fitting;    // compositing: lists that are left as they are, those that have no grains; else 0
  VDI_ADDRESS(UintArray) fittingOffsets;  // [lists + 1]: where they are
  VDI_ADDRESS(UintArray) guard;         // [1]: 0 if there's no room for what's left, or the grains aren't there
  float step;  // of the sample lattice
  uint listCount;
  uint teamCapacity;  // grains of a list that a team has room for; 0: there are no teams
  uint pad;
  StoredForm form;  // of segments
};

VDI_SHARED_END

#endif
