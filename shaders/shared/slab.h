// The table of slabs, the parts of a ray that one sample represents (core/SlabTable.h, shaders/slab.glsl).
#ifndef VDI_SHARED_SLAB_H
#define VDI_SHARED_SLAB_H
#include "interop.h"

VDI_SHARED_BEGIN

// Texels per side of the table's square part; and the distance, in texels, between the starts of two rows of
// a strip. Rows share a texel, so filtering needs no other row.
VDI_CONST uint slabSide = 256u;
VDI_CONST uint slabStripStep = slabSide - 1u;

VDI_SHARED_END

#endif
