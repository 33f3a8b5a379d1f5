// The table of slabs: what the part of a ray that a sample stands for shows (core/SlabTable.h, shaders/slab.glsl).
#ifndef VDI_SHARED_SLAB_H
#define VDI_SHARED_SLAB_H
#include "interop.h"

VDI_SHARED_BEGIN

// Texels per side of the table's square part; and how far apart, in texels, a row of its strips begins behind the last one:
// rows share a texel, so that filtering needs no other row.
VDI_CONST uint slabSide = 256u;
VDI_CONST uint slabStripStep = slabSide - 1u;

VDI_SHARED_END

#endif
