// The sampling rate that a transfer function needs on a volume, for GenerateSettings' automaticRate.
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

/// The scalars along one sample of a ray. Its place and direction depend only on `index` and the scene, so
/// every decomposition of a volume has the same probes.
struct Probe {
  /// Positions of the scalars relative to the probe's place, in samples at rate 1.
  static constexpr std::array<double, 5> offsets{-0.5, -0.25, 0.0, 0.25, 0.5};
  std::uint64_t index = 0;
  std::array<double, 5> scalars{};
};

/// The probes whose places the blocks own, sorted by index. The blocks must have their neighbours' values.
std::vector<Probe> probesOf(const Scene& scene, std::span<const Block> blocks);

/// 1, 2 or 4 samples per voxel: the first rate at which a slab shows what its two halves show. A slab assumes
/// that the scalar runs linearly. Where it does not, the slab's error grows with the transfer function's
/// slope. Only the region's probes count. `probes` come from all ranks, in the same order on each rank,
/// because the sum depends on it.
double samplingRateFor(const TransferTable& table, const Scene& scene, const Region& region,
                       std::span<const Probe> probes);

}  // namespace vdi
