// Parameters of merge.comp and composite.comp: the owner's side of compositing (paper, section 5.2).
#ifndef VDI_SHARED_COMPOSITE_H
#define VDI_SHARED_COMPOSITE_H
#include "lists.h"

VDI_SHARED_BEGIN

#ifdef __cplusplus
inline constexpr uint compositeGroup = 64;
inline constexpr uint mergeModeCount = 0;
inline constexpr uint mergeModeMerge = 1;
inline constexpr uint compositeProgramSearch = 0;
inline constexpr uint compositeProgramCountGrains = 1;
inline constexpr uint compositeProgramWriteGrains = 2;
inline constexpr uint compositeProgramSurvey = 3;
inline constexpr uint compositeModeSearch = 0;
inline constexpr uint compositeModeWrite = 1;
#else
const uint compositeGroup = 64;
const uint mergeModeCount = 0;  // counts[list] = sum over ranks
const uint mergeModeMerge = 1;  // writes merged
const uint compositeProgramSearch = 0;  // as castProgramSearch and so on
const uint compositeProgramCountGrains = 1;
const uint compositeProgramWriteGrains = 2;
const uint compositeProgramSurvey = 3;
const uint compositeModeSearch = 0;
const uint compositeModeWrite = 1;
#endif

#ifndef __cplusplus
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer SegmentsOfRank { SegmentArray at[]; };
#endif

struct MergeConstants {
  VDI_ADDRESS(SegmentsOfRank) received;  // [ranks]: addresses of each rank's compact lists
  VDI_ADDRESS(UintArray) subOffsets;     // [ranks][lists + 1], each rank's from 0
  VDI_ADDRESS(UintArray) heads;          // [ranks][lists], scratch
  VDI_ADDRESS(UintArray) counts;         // [lists]
  VDI_ADDRESS(UintArray) offsets;        // [lists + 1]
  VDI_ADDRESS(SegmentArray) merged;      // ordered by depth within each list
  uint listCount;
  uint rankCount;
  uint mode;
  uint pad;
  StoredForm form;  // of received and merged
};

struct CompositeParams {
  VDI_ADDRESS(SegmentArray) merged;
  VDI_ADDRESS(UintArray) mergedOffsets;  // [lists + 1]
  VDI_ADDRESS(FloatArray) sensitivities;
  VDI_ADDRESS(UintArray) counts;
  VDI_ADDRESS(UintArray) offsets;
  VDI_ADDRESS(SegmentArray) segments;
  VDI_ADDRESS(GrainArray) grains;
  VDI_ADDRESS(UintArray) written;
  VDI_ADDRESS(UintArray) left;
  VDI_ADDRESS(UintArray) status;
  VDI_ADDRESS(UintArray) survey;
  float step;  // of the sample lattice
  uint budget;
  uint runsOnly;  // 0
  uint listCount;
  uint mostPerList;
  float level;  // as in CastParams
  StoredForm form;  // of merged and segments
};

struct CompositeConstants {
  uint mode;
};

VDI_SHARED_END

#endif
