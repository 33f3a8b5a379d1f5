// Parameters of quota.comp: the ranks' agreement on lists that they have counted together.
#ifndef VDI_SHARED_QUOTA_H
#define VDI_SHARED_QUOTA_H
#include "lists.h"

VDI_SHARED_BEGIN

VDI_CONST uint quotaGroup = 64;

struct QuotaConstants {
  VDI_ADDRESS(UintArray) own;          // [rows][width][countedLevelWords]: this rank's counts
  // [rows][width][countedLevelWords]: the sum of all ranks' counts, byte by byte, at most 255
  VDI_ADDRESS(UintArray) sum;
  // [rows][width]: the finest tolerance with few enough pre-segments in all; 0: an empty list
  VDI_ADDRESS(FloatArray) tolerances;
  VDI_ADDRESS(UintArray) preSegments;  // [rows][width]: this rank's number at that tolerance
  VDI_ADDRESS(UintArray) quotas;       // [rows][width]: as in InterpolateConstants
  // [rows]: sum of the supersegments that all ranks together will have in a row
  VDI_ADDRESS(UintArray) weights;
  uint width;
  uint rows;
  uint budget;
  uint levelShift;
  uint levelCount;  // number of tolerances, from countedTolerance on
  uint pad;
};

VDI_SHARED_END

#endif
