// ParaView's default for the distance over which opacities hold.
#pragma once

#include "vdi/core/Box.h"

namespace vdi {

/// The value that ParaView uses for *Scalar Opacity Unit Distance* 0: the diagonal of the bounds, times the
/// cube root of a voxel's share of their volume. `voxelVolume` is that of the smallest voxel. Returns 1 if
/// there is no volume.
double unitDistanceOf(const Box& bounds, double voxelVolume);

}  // namespace vdi
