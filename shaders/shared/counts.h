// Parameters of counts.comp: packs lists' counts for exchange between ranks.
#ifndef VDI_SHARED_COUNTS_H
#define VDI_SHARED_COUNTS_H
#include "lists.h"

VDI_SHARED_BEGIN

VDI_CONST uint countsGroup = 256;
VDI_CONST uint countsPerWord = 4;  // lists whose counts share a word, a byte each, the first one lowest
VDI_CONST uint countsModePack = 0;      // offsets -> packed, and tooLarge if a count does not fit a byte
VDI_CONST uint countsModePackWide = 1;  // offsets -> packed, a word each
VDI_CONST uint countsModeUnpack = 2;    // packed, bytes -> counts

struct CountsConstants {
  VDI_ADDRESS(UintArray) offsets;   // [listCount + 1]
  VDI_ADDRESS(UintArray) packed;    // a word for four lists, or for one
  VDI_ADDRESS(UintArray) counts;    // four for each word
  VDI_ADDRESS(UintArray) tooLarge;  // [1]
  uint listCount;
  uint words;  // number of words in packed
  uint mode;
  uint pad;
};

VDI_SHARED_END

#endif
