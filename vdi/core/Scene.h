// What all ranks must agree on before rays can be cast: where the data is and where the samples lie.
#pragma once

#include <cstdint>
#include <span>

#include "vdi/core/Block.h"
#include "vdi/core/Box.h"
#include "vdi/core/Camera.h"

namespace vdi {

/// The union over all ranks. `localScene` gives one rank's part, comm::globalScene reduces it.
struct Scene {
  Box bounds;               // union of the owned boxes; empty when no rank holds anything
  double minSpacing = 0.0;  // smallest spacing of any block and axis; 0 when there's no block
  bool operator==(const Scene&) const = default;
};

Scene localScene(std::span<const Block> blocks);

/// Coordinate `value` of an owned box rounded to a lattice of 2^-20 of the scene's extent around the scene's
/// centre, and given relative to that centre in single precision. Two blocks that share a face, computed on
/// two ranks with other rounding, get the same float: every sample has exactly one owner.
float snapToScene(const Scene& scene, double value, int axis);

/// Sample k of every ray covers the depths [first + k * step, first + (k + 1) * step] and is taken at the
/// middle. The lattice depends on the scene and the camera alone, so any decomposition of the data yields the
/// same samples.
struct DepthLattice {
  double first = 0.0;       // depth, >= 0: nothing at or behind the eye is sampled
  double step = 0.0;        // depth, > 0 unless count == 0
  std::uint32_t count = 0;  // 0 when no part of the scene lies in front of the camera

  double frontOf(std::uint32_t k) const { return first + k * step; }
};

/// step = scene.minSpacing / samplesPerVoxel. Throws Error{InvalidArgument} when samplesPerVoxel isn't in
/// [1/64, 64] or when a ray would need more than 2^24 samples.
DepthLattice depthLattice(const Scene& scene, const View& view, double samplesPerVoxel);

/// How far beyond its owned box a block has values, in its spacings, where it has neighbours. Gradients need
/// that much: a voxel on each side of a sample's middle.
inline constexpr double valueReach = 1.0;

/// How far beyond it the ends of slabs may lie.
inline constexpr double slabReach = 0.9;

/// Whether samples are slabs, classified by what lies between their two ends, rather than by the scalar in
/// their middle. They are unless half a sample is longer than slabReach of the finest voxel: from somewhat
/// more than half a sample per voxel on.
bool samplesAreSlabs(const Scene& scene, const View& view, const DepthLattice& lattice);

}  // namespace vdi
