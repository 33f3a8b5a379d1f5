// The sampling rate that a transfer function needs on a volume: GenerateSettings::samplesPerVoxel 0.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "vdi/core/Block.h"
#include "vdi/core/Region.h"
#include "vdi/core/Scene.h"
#include "vdi/core/TransferFunction.h"

namespace vdi {

/// The scalars along one sample of a ray, at a place and in a direction that only `index` and the scene
/// decide. Every decomposition of a volume has the same probes.
struct Probe {
  /// Where the scalars are, in samples at rate 1 from the probe's place.
  static constexpr std::array<double, 5> offsets{-0.5, -0.25, 0.0, 0.25, 0.5};
  std::uint64_t index = 0;
  std::array<double, 5> scalars{};
};

/// Those of the scene's probes whose place the blocks own, by index. The blocks have their neighbours'
/// values.
std::vector<Probe> probesOf(const Scene& scene, std::span<const Block> blocks);

/// 1, 2 or 4 samples per voxel: the first at which slabs show what two halves of them show. A slab takes the
/// scalar to run linearly. Where it doesn't, the slab's error is as large as the transfer function is steep.
/// Only what the region shows counts. `probes`: of all ranks, in an order that is the same on each of them,
/// for the sum depends on it.
double samplingRateFor(const TransferTable& table, const Scene& scene, const Region& region,
                       std::span<const Probe> probes);

}  // namespace vdi
