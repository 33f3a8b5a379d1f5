// Probes of a volume, and what they tell: the sampling rate that a transfer function needs, for
// GenerateSettings' automaticRate, and how much of their range the values fill.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
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
  double value = 0.0;  // the value nearest to the probe's place, without interpolation
};

/// The probes whose places the blocks own, sorted by index. The blocks must have their neighbours' values.
std::vector<Probe> probesOf(const Scene& scene, std::span<const Block> blocks);

/// 1, 2 or 4 samples per voxel: the first rate at which a slab shows what its two halves show. A slab assumes
/// that the scalar runs linearly. Where it does not, the slab's error grows with the transfer function's
/// slope. Only the region's probes count. `probes` come from all ranks, in the same order on each rank,
/// because the sum depends on it.
double samplingRateFor(const TransferTable& table, const Scene& scene, const Region& region,
                       std::span<const Probe> probes);

/// The part that 99 % of the probes' finite values fill, if it is less than a 256th of the range; nullopt if
/// it is more, or a single value. Values that equal an end of the range, as fill values do, may count as
/// outside the part, however many they are.
std::optional<ScalarRange> crowdedPart(const ScalarRange& range, std::span<const Probe> probes);
/// A sentence about such a part of an automatic range, for users.
std::string describeCrowded(const ScalarRange& range, const ScalarRange& part);

}  // namespace vdi
