// Parameters of reduce.comp.
#ifndef VDI_SHARED_REDUCE_H
#define VDI_SHARED_REDUCE_H
#include "lists.h"

VDI_SHARED_BEGIN

#ifdef __cplusplus
inline constexpr uint reduceGroup = 64;
inline constexpr uint reduceModeCount = 0;
inline constexpr uint reduceModeWrite = 1;
#else
const uint reduceGroup = 64;
const uint reduceModeCount = 0;  // counts[list] = supersegments that are left
const uint reduceModeWrite = 1;  // merges and writes
#endif

struct ReduceConstants {
  VDI_ADDRESS(GrainArray) grains;
  VDI_ADDRESS(Vec4Array) lights;    // of the grains
  VDI_ADDRESS(UintArray) grainOffsets;  // [lists + 1]
  VDI_ADDRESS(UvecArray) reductions;    // [lists]: grains written, and how many are to be left of them
  VDI_ADDRESS(UintArray) counts;        // [lists]
  VDI_ADDRESS(UintArray) offsets;       // [lists + 1]
  VDI_ADDRESS(SegmentArray) segments;
  float step;  // of the sample lattice
  uint listCount;
  uint mode;
  uint pad;
  StoredForm form;  // of segments
};

VDI_SHARED_END

#endif
