// Parameters of scan.comp: exclusive prefix sums.
#ifndef VDI_SHARED_SCAN_H
#define VDI_SHARED_SCAN_H
#include "lists.h"

VDI_SHARED_BEGIN

VDI_CONST uint scanGroup = 256;
VDI_CONST uint scanPerThread = 8;
VDI_CONST uint scanModeSum = 0;  // values -> prefix within each group's part, sums[group] = the part's total
VDI_CONST uint scanModeAdd = 1;  // prefix += sums of the preceding groups
VDI_CONST uint scanModeRebase = 2;  // prefix += base

struct ScanConstants {
  VDI_ADDRESS(UintArray) values;
  VDI_ADDRESS(UintArray) prefix;  // count + 1 entries
  VDI_ADDRESS(UintArray) sums;
  VDI_ADDRESS(UintArray) overflow;  // [1], set to 1 if a total does not fit 32 bits
  // Set to 1 if the total is at most `room` and the word at `guardBefore` is 1, else to 0. An address of 0
  // disables its part of this rule.
  VDI_ADDRESS(UintArray) guard;
  VDI_ADDRESS(UintArray) guardBefore;
  uint count;
  uint mode;
  uint base;
  uint room;
};

VDI_SHARED_END

#endif
