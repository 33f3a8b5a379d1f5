// Parameters of cells.comp: macrocells, which tell where a rank's blocks hold nothing visible.
#ifndef VDI_SHARED_CELLS_H
#define VDI_SHARED_CELLS_H
#include "volume.h"

VDI_SHARED_BEGIN

VDI_CONST uint cellsGroup = 64;
VDI_CONST uint cellsModeMeasure = 0;   // texels -> ranges
VDI_CONST uint cellsModeClassify = 1;  // ranges and transfer table -> visible

// Texels of infinite values are finite, so that filters don't make NaN of them: the second largest
// float there is.
VDI_CONST uint infiniteTexelBits = 0x7f7ffffeu;

VDI_CONST uint pieceRangeWords = 3u;

// The macrocells of a piece of a texture page: cell c of an axis has the texels [c * cellSide, (c + 1) * cellSide] of the
// piece, and one more at either end, which a filter may touch when it rounds.
struct CellPiece {
  uvec3 place;  // in the page, texels
  uint page;
  uvec3 dims;  // texels
  uint firstCell;
  uvec3 cellDims;
  float tableScale;  // as in Brick
  float tableOrigin;
};

VDI_SHARED_END

#ifndef __cplusplus
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer CellPieceArray { CellPiece at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer CellRangeArray { vec2 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer CellArray { uint at[]; };
#endif

VDI_SHARED_BEGIN

struct CellsConstants {
  VDI_ADDRESS(CellPieceArray) pieces;  // by firstCell
  VDI_ADDRESS(CellRangeArray) ranges;  // [cells]: smallest and largest texel but for NaN; upside down if there's none
  // [pieces][pieceRangeWords]: the same of pieces, but for infinite texels. All bits set beforehand: the smallest, and the
  // inverted bits of the largest, as bits of floats that are ordered as unsigned numbers (of negative ones all inverted, of
  // others the sign). Then 0 where there are infinite texels.
  VDI_ADDRESS(CellArray) pieceRanges;
  VDI_ADDRESS(CellArray) visible;      // [cells]: 1 or 0
  VDI_ADDRESS(CellArray) visibleBefore;  // [tableSize + 1]: how many of the table's first entries aren't transparent
  uint pieceCount;
  uint cellCount;
  uint tableSize;
  uint mode;
};

VDI_SHARED_END

#endif
