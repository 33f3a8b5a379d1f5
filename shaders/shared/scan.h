// Parameters of scan.comp: exclusive prefix sums.
#ifndef VDI_SHARED_SCAN_H
#define VDI_SHARED_SCAN_H
#include "lists.h"

VDI_SHARED_BEGIN

#ifdef __cplusplus
inline constexpr uint scanGroup = 256;
inline constexpr uint scanPerThread = 8;
inline constexpr uint scanModeSum = 0;
inline constexpr uint scanModeAdd = 1;
inline constexpr uint scanModeRebase = 2;
#else
const uint scanGroup = 256;
const uint scanPerThread = 8;
const uint scanModeSum = 0;  // values -> prefix within each workgroup's part, sums[group] = total of the part
const uint scanModeAdd = 1;  // prefix += sums of the groups before
const uint scanModeRebase = 2;  // prefix += base
#endif

struct ScanConstants {
  VDI_ADDRESS(UintArray) values;
  VDI_ADDRESS(UintArray) prefix;  // count + 1 entries
  VDI_ADDRESS(UintArray) sums;
  VDI_ADDRESS(UintArray) overflow;  // [1], set to 1 when a total doesn't fit 32 bits
  // Set to 1 if the total is `room` at most, and what `guardBefore` points to is 1; else to 0. 0: nothing is set, or asked.
  VDI_ADDRESS(UintArray) guard;
  VDI_ADDRESS(UintArray) guardBefore;
  uint count;
  uint mode;
  uint base;
  uint room;
};

VDI_SHARED_END

#endif
