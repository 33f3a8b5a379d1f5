// Parameters of cells.comp: macrocells, which show where a rank's blocks have no visible values.
#ifndef VDI_SHARED_CELLS_H
#define VDI_SHARED_CELLS_H
#include "slab.h"
#include "volume.h"

VDI_SHARED_BEGIN

VDI_CONST uint cellsGroup = 64;
VDI_CONST uint cellsModeMeasure = 0;   // texels -> ranges
VDI_CONST uint cellsModeClassify = 1;  // ranges and transfer table -> visible

// Infinite values become the second largest float as texels, so that filters do not turn them into NaN.
VDI_CONST uint infiniteTexelBits = 0x7f7ffffeu;

// The words of a piece's ranges: the smallest texel and the inverted bits of the largest one, of all texels
// and of own ones, and whether there are infinite texels.
VDI_CONST uint pieceRangeAll = 0u;
VDI_CONST uint pieceRangeOwn = 2u;
VDI_CONST uint pieceRangeInfinite = 4u;
VDI_CONST uint pieceRangeWords = 5u;

// Texels of a piece, lo <= texel < hi.
struct TexelBox {
  uvec3 lo;
  uvec3 hi;
};

// The macrocells of a piece of a texture page. Cell c of an axis has the piece's texels [c * cellSide, (c +
// 1) * cellSide], and one more at either end, which a filter may read because of rounding.
struct CellPiece {
  uvec3 place;  // in the page, texels
  uint page;
  uvec3 dims;  // texels
  uint firstCell;
  uvec3 cellDims;
  float tableScale;  // as in Brick
  float tableOrigin;
  uint firstOwn;  // boxes of own texels; they may overlap
  uint ownCount;
};

VDI_SHARED_END

#ifndef __cplusplus
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer CellPieceArray {
  CellPiece at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer TexelBoxArray {
  TexelBox at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer CellRangeArray {
  vec2 at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer CellArray {
  uint at[];
};
#endif

VDI_SHARED_BEGIN

struct CellsConstants {
  VDI_ADDRESS(CellPieceArray) pieces;  // by firstCell
  VDI_ADDRESS(TexelBoxArray) own;      // by firstOwn
  // [cells]: smallest and largest texel, ignoring NaN; inverted if there is none
  VDI_ADDRESS(CellRangeArray) ranges;
  // [pieces][pieceRangeWords]. The ranges ignore NaN and infinite texels. Floats are stored as bits that
  // compare as unsigned numbers: negative ones with all bits inverted, others with the sign inverted. The
  // word for infinite texels becomes 0 if there are any. All bits are set beforehand.
  VDI_ADDRESS(CellArray) pieceRanges;
  VDI_ADDRESS(CellArray) visible;  // [cells]: 1 or 0
  // [tableSize + 1]: number of visible entries, or pieces, before each one of the table
  VDI_ADDRESS(CellArray) visibleBefore;
  VDI_ADDRESS(PieceStartArray) pieceStarts;  // [tableSize]; 0: the table has entries
  uint pieceCount;
  uint cellCount;
  uint tableSize;
  uint mode;
  uint hasPieces;
};

VDI_SHARED_END

#endif
