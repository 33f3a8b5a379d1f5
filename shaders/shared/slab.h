// The table of slabs, the parts of a ray that one sample represents (core/SlabTable.h, shaders/slab.glsl).
#ifndef VDI_SHARED_SLAB_H
#define VDI_SHARED_SLAB_H
#include "interop.h"

VDI_SHARED_BEGIN

// Texels per side of the table's square part; and the distance, in texels, between the starts of two rows of
// a strip. Rows share a texel, so filtering needs no other row.
VDI_CONST uint slabSide = 256u;
VDI_CONST uint slabStripStep = slabSide - 1u;

// A slab of pieces (shaders/pieces.glsl) is integrated in that many parts where its optical depth is larger
// than this; in less, nearer material hides nothing.
VDI_CONST uint slabParts = 64u;
VDI_CONST float slabThin = 0.1f;

// A stretch of the transfer function, linear in associated colour and extinction (TransferPiece in
// core/TransferFunction.h).
struct SlabPiece {
  float start;  // positions
  float end;
  vec4 front;  // at its start
  vec4 back;   // at its end
  vec4 sum;    // the function's integral from the second piece's start to this one's
  vec4 sumRest;  // what rounding has taken from the sum
};

VDI_SHARED_END

#ifndef __cplusplus
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer SlabPieceArray {
  SlabPiece at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer PieceStartArray {
  float at[];
};
#endif

#endif
