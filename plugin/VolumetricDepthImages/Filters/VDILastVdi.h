// What a filter's last VDI was, as the numbers by which its client learns of it: the next one is estimated
// from that.
#ifndef VDILastVdi_h
#define VDILastVdi_h

#include <array>
#include <cstdint>
#include <optional>

#include "vdi/core/Estimate.h"

namespace pv {

/// All 0 where there is none.
using LastVdiNumbers = std::array<double, 13>;

inline LastVdiNumbers numbersOf(const vdi::MadeVdi& made) {
  const vdi::GenerateSettings& settings = made.settings;
  return {1.0 * settings.width,
          1.0 * settings.height,
          settings.margin,
          1.0 * settings.supersegments,
          static_cast<double>(settings.budget),
          settings.fill,
          settings.samplesPerVoxel,
          static_cast<double>(settings.algorithm),
          static_cast<double>(settings.precision),
          static_cast<double>(made.lists),
          static_cast<double>(made.supersegments),
          made.castSeconds,
          made.listSeconds};
}

inline std::optional<vdi::MadeVdi> lastVdiOf(const LastVdiNumbers& numbers) {
  const auto count = [&](std::size_t i) { return static_cast<std::uint64_t>(numbers[i]); };
  vdi::MadeVdi made;
  vdi::GenerateSettings& settings = made.settings;
  settings.width = static_cast<int>(numbers[0]);
  settings.height = static_cast<int>(numbers[1]);
  settings.margin = numbers[2];
  settings.supersegments = static_cast<std::uint32_t>(numbers[3]);
  settings.budget = static_cast<vdi::Budget>(count(4));
  settings.fill = numbers[5];
  settings.samplesPerVoxel = numbers[6];
  settings.algorithm = static_cast<vdi::Algorithm>(count(7));
  settings.precision = static_cast<vdi::Precision>(count(8));
  made.lists = count(9);
  made.supersegments = count(10);
  made.castSeconds = numbers[11];
  made.listSeconds = numbers[12];
  if (made.lists == 0) return std::nullopt;
  return made;
}

}  // namespace pv

#endif
