// Parameters of reduce.comp.
#ifndef VDI_SHARED_REDUCE_H
#define VDI_SHARED_REDUCE_H
#include "lists.h"

VDI_SHARED_BEGIN

#ifdef __cplusplus
inline constexpr uint reduceGroup = 64;
#else
const uint reduceGroup = 64;
#endif

struct ReduceConstants {
  VDI_ADDRESS(GrainArray) grains;
  VDI_ADDRESS(UintArray) grainOffsets;  // [lists + 1]
  VDI_ADDRESS(UintArray) written;       // [lists]: grains
  VDI_ADDRESS(UintArray) offsets;       // [lists + 1], of what's to be left of them
  VDI_ADDRESS(SegmentArray) segments;
  float step;  // of the sample lattice
  uint listCount;
  StoredForm form;  // of segments
};

VDI_SHARED_END

#endif
