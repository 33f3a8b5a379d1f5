// The facts that all ranks must agree on before they cast rays: the data's extent and the samples' positions.
#pragma once

#include <cstdint>
#include <span>

#include "vdi/core/Block.h"
#include "vdi/core/Box.h"
#include "vdi/core/Camera.h"

namespace vdi {

/// Extent of the data of all ranks. `localScene` gives one rank's part; VdiGenerator::scene gives the whole.
struct Scene {
  Box bounds;               // union of the owned boxes; empty if no rank has a block
  double minSpacing = 0.0;  // smallest spacing of any block and axis; 0 without blocks
  bool operator==(const Scene&) const = default;
};

Scene localScene(std::span<const Block> blocks);

/// Coordinate `value` of an owned box, relative to the scene's centre in single precision, and rounded to a
/// lattice of 2^-20 of the scene's extent around it. Two blocks that share a face get the same float even if
/// two ranks computed it with different rounding, so every sample has exactly one owner.
float snapToScene(const Scene& scene, double value, int axis);

/// Sample k of every ray covers the depths [first + k * step, first + (k + 1) * step] and is taken at the
/// middle. The lattice depends only on the scene and the camera, so any decomposition of the data yields the
/// same samples.
struct DepthLattice {
  double first = 0.0;       // depth, >= 0: samples lie in front of the eye
  double step = 0.0;        // depth, > 0 unless count == 0
  std::uint32_t count = 0;  // 0 when no part of the scene lies in front of the camera

  double frontOf(std::uint32_t k) const { return first + k * step; }
};

/// step = scene.minSpacing / samplesPerVoxel. Throws Error{InvalidArgument} when samplesPerVoxel is not in
/// [1/64, 64] or when a ray would need more than 2^24 samples.
DepthLattice depthLattice(const Scene& scene, const View& view, double samplesPerVoxel);

/// Whether depths as floats distinguish the lattice's first samples. They don't if the camera is far away.
bool floatsResolve(const DepthLattice& lattice);

/// The distance, in spacings, up to which a block has values beyond its owned box where it has neighbours.
/// Gradients need one voxel on each side of a sample's middle.
inline constexpr double valueReach = 1.0;

/// The distance beyond the owned box to which the ends of slabs may reach.
inline constexpr double slabReach = 0.9;

/// Whether samples are slabs, classified by the scalars at their two ends instead of the one in their middle.
/// They are unless half a sample is longer than slabReach of the finest voxel: from slightly more than half a
/// sample per voxel on.
bool samplesAreSlabs(const Scene& scene, const View& view, const DepthLattice& lattice);

/// The distance from a sample's middle up to which blocks have values (valueReach), so that the sample may be
/// classified there. The unit is one sample of a ray along an axis; a ray whose direction's longest component
/// is c reaches 1/c as far. The ends of slabs are nearer, but a ray's outermost sample may extend farther, to
/// the bounds. Beyond the reach, it has the material of the nearest place in reach.
double outermostReach(const Scene& scene, const DepthLattice& lattice);

}  // namespace vdi
