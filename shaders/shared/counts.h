// Parameters of counts.comp: how many supersegments lists hold, as ranks tell each other.
#ifndef VDI_SHARED_COUNTS_H
#define VDI_SHARED_COUNTS_H
#include "lists.h"

VDI_SHARED_BEGIN

#ifdef __cplusplus
inline constexpr uint countsGroup = 256;
inline constexpr uint countsPerWord = 4;
inline constexpr uint countsModePack = 0;
inline constexpr uint countsModePackWide = 1;
inline constexpr uint countsModeUnpack = 2;
#else
const uint countsGroup = 256;
const uint countsPerWord = 4;  // lists whose counts are the bytes of a word, the first one lowest
const uint countsModePack = 0;      // offsets -> packed, and tooLarge if a count has no room in a byte
const uint countsModePackWide = 1;  // offsets -> packed, a word each
const uint countsModeUnpack = 2;    // packed, bytes -> counts
#endif

struct CountsConstants {
  VDI_ADDRESS(UintArray) offsets;   // [listCount + 1]
  VDI_ADDRESS(UintArray) packed;    // a word for four lists, or for one
  VDI_ADDRESS(UintArray) counts;    // four for each word
  VDI_ADDRESS(UintArray) tooLarge;  // [1]
  uint listCount;
  uint words;  // of packed
  uint mode;
  uint pad;
};

VDI_SHARED_END

#endif
