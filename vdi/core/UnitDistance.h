// The distance over which ParaView's opacities hold where nobody has set one.
#pragma once

#include "vdi/core/Box.h"

namespace vdi {

/// What *Scalar Opacity Unit Distance* 0 stands for in ParaView: the diagonal of the bounds, times the cube
/// root of a voxel's share of their volume. `voxelVolume` is the smallest one's; 1 where there is no volume.
double unitDistanceOf(const Box& bounds, double voxelVolume);

}  // namespace vdi
