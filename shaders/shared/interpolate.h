// Parameters of interpolate.comp.
#ifndef VDI_SHARED_INTERPOLATE_H
#define VDI_SHARED_INTERPOLATE_H
#include "lists.h"

VDI_SHARED_BEGIN

VDI_CONST uint interpolateGroup = 64;

// A band of lists; every stride-th list of every stride-th row is counted.
struct InterpolateConstants {
  // [countedRows][countedWidth]: the finest tolerance with few enough pre-segments
  VDI_ADDRESS(FloatArray) countedTolerances;
  // [countedRows][countedWidth]: number of pre-segments at that tolerance
  VDI_ADDRESS(UintArray) countedPreSegments;
  VDI_ADDRESS(FloatArray) tolerances;         // [rows][width]
  VDI_ADDRESS(UintArray) capacities;          // [rows][width]
  // With other ranks; otherwise 0. The low half of a word is this rank's quota of supersegments in the list;
  // the high half is the part of the room for pre-segments that begin runs. First for the counted lists, then
  // for all.
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
