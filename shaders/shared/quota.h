// Parameters of quota.comp: what ranks agree on about lists that they've counted together.
#ifndef VDI_SHARED_QUOTA_H
#define VDI_SHARED_QUOTA_H
#include "lists.h"

VDI_SHARED_BEGIN

VDI_CONST uint quotaGroup = 64;

struct QuotaConstants {
  VDI_ADDRESS(UintArray) own;          // [rows][width][countedLevelWords]: what this rank counted
  VDI_ADDRESS(UintArray) sum;          // likewise: byte by byte what all did, 255 at most
  VDI_ADDRESS(FloatArray) tolerances;  // [rows][width]: the finest that gives few enough pre-segments in all; 0: there's nothing
  VDI_ADDRESS(UintArray) preSegments;  // [rows][width]: this rank's at that tolerance
  VDI_ADDRESS(UintArray) quotas;       // [rows][width]: as in InterpolateConstants
  VDI_ADDRESS(UintArray) weights;      // [rows]: supersegments that all ranks together will have in a row, added
  uint width;
  uint rows;
  uint budget;
  uint levelShift;
  uint levelCount;  // of tolerances, from countedTolerance on
  uint pad;
};

VDI_SHARED_END

#endif
