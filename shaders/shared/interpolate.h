// Parameters of interpolate.comp.
#ifndef VDI_SHARED_INTERPOLATE_H
#define VDI_SHARED_INTERPOLATE_H
#include "lists.h"

VDI_SHARED_BEGIN

VDI_CONST uint interpolateGroup = 64;

// A band of lists, of which every stride-th in a row of every stride-th row is counted.
struct InterpolateConstants {
  VDI_ADDRESS(FloatArray) countedTolerances;  // [countedRows][countedWidth]: the finest that gives few enough pre-segments
  VDI_ADDRESS(UintArray) countedPreSegments;  // likewise: these
  VDI_ADDRESS(FloatArray) tolerances;         // [rows][width]
  VDI_ADDRESS(UintArray) capacities;          // likewise
  // With other ranks, else 0: in the low half of a word, how many supersegments this rank may have in the list; in the high
  // half, how much of the room is for pre-segments that begin runs. And what that is in the counted lists.
  VDI_ADDRESS(UintArray) countedQuotas;
  VDI_ADDRESS(UintArray) quotas;
  uint width;
  uint rows;
  uint countedWidth;
  uint countedRows;
  uint strideShift;  // log2 of the stride
  uint budget;       // with other ranks: N_S
};

VDI_SHARED_END

#endif
