// The bytes of a VDI; and an estimate of these, and of the time that a VDI takes, before it is made.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "vdi/core/GenerateSettings.h"
#include "vdi/core/Supersegment.h"

namespace vdi {

/// Of lists with so many supersegments in all, where `Number` counts them.
template <typename Number>
constexpr Number bytesInMemory(Number lists, Number supersegments, Precision precision) {
  const std::size_t each =
      precision == Precision::Compact ? sizeof(CompactSupersegment) : sizeof(Supersegment);
  return lists * static_cast<Number>(sizeof(std::uint32_t)) + supersegments * static_cast<Number>(each);
}

/// A VDI that has been made.
struct MadeVdi {
  GenerateSettings settings;  // samplesPerVoxel as it was, never automaticRate
  std::uint64_t lists = 0;    // margin included
  std::uint64_t supersegments = 0;
  double castSeconds = 0.0;  // casting rays, of the slowest rank
  double listSeconds = 0.0;  // sending, compositing and gathering lists, likewise
};

struct VdiEstimate {
  double bytesInMemory = 0.0;
  double mostBytesInMemory = 0.0;  // with every list full
  double bytesAsFile = 0.0;
  std::optional<double> seconds;  // without the upload of values
  bool isFromLast = false;
};

/// Of N_S, the share that lists hold in a volume about which nothing is known. In nine scenes it was 0.05 to
/// 0.26 (docs/benchmarks.md, "How much is stored").
constexpr double typicalFill = 0.15;

/// The bytes that a supersegment takes in a file, on average.
constexpr double packedBytes(Precision precision) {
  return precision == Precision::Compact ? 5.5 : 14.5;
}

/// Supersegments grow with lists and N_S, as of `last`, a VDI of the same volume and transfer function; or
/// else lists hold typicalFill. Casting takes as long for each sample, the rest for each supersegment; there
/// is no time without `last`, nor for another algorithm or budget. The viewpoint counts for nothing.
VdiEstimate estimateOf(const GenerateSettings& settings, const std::optional<MadeVdi>& last);

}  // namespace vdi
