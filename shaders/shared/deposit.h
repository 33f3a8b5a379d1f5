// Parameters of deposit.comp: spreads particles over the cells of blocks.
#ifndef VDI_SHARED_DEPOSIT_H
#define VDI_SHARED_DEPOSIT_H
#include "interop.h"

VDI_SHARED_BEGIN

VDI_CONST uint depositGroup = 64;

// Kernels by which a particle spreads (vdi/core/Particles.h).
VDI_CONST uint depositModeCloud = 0;   // cloud in cell; the shares add up to 1
VDI_CONST uint depositModeKernel = 1;  // cubic spline; the device divides the shares by their sum
VDI_CONST uint depositModeShares = 2;  // cubic spline; `weight` has been divided by the sum of shares

// A particle as one block gets it. Positions count cells of the block from the lower corner of its first
// stored cell. With `parts` they count equal parts of cells.
struct DepositParticle {
  int cellX;  // the cell of the position, which may lie outside the block
  int cellY;
  int cellZ;
  vec3 within;   // the position in that cell, from 0 to 1
  vec3 size;     // cloud: its edges in cells; kernel: a cell's edges in units of h
  float weight;  // in units of the sums
  uint parts;    // per axis, less 1: 10 bits each, x lowest
  uint block;    // index of DepositBlock
  uint mode;
  // The cells, all of them stored, on which to deposit: from first to below last, counted as the position.
  int firstX;
  int firstY;
  int firstZ;
  int lastX;
  int lastY;
  int lastZ;
};

// A block's sums, as 64-bit integers in two's complement: two words each, the lower one first, x fastest.
struct DepositBlock {
  VDI_ADDRESS(uint64_t) sums;
  uint cellsX;
  uint cellsY;
  uint cellsZ;
  uint pad;
};

VDI_SHARED_END

#ifndef __cplusplus
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer DepositParticleArray {
  DepositParticle at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer DepositBlockArray {
  DepositBlock at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer DepositSums {
  uint at[];
};
#endif

VDI_SHARED_BEGIN

struct DepositConstants {
  VDI_ADDRESS(DepositParticleArray) particles;  // [count]
  VDI_ADDRESS(DepositBlockArray) blocks;
  uint count;
  uint pad;
};

VDI_SHARED_END

#endif
