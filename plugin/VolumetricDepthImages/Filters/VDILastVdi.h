// A filter's last VDI as numbers, which the client receives. From them it estimates the next VDI.
#ifndef VDILastVdi_h
#define VDILastVdi_h

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "vdi/core/Estimate.h"
#include "vdi/core/SettingsTable.h"

namespace pv {

/// All 0 if there is no VDI.
using LastVdiNumbers = std::array<double, vdi::settingCount + 6>;

inline LastVdiNumbers numbersOf(const vdi::MadeVdi& made) {
  LastVdiNumbers numbers{1.0 * made.settings.width, 1.0 * made.settings.height};
  std::size_t i = 2;
  for (const vdi::Setting& setting : vdi::settingsTable()) numbers[i++] = setting.get(made.settings);
  numbers[i++] = static_cast<double>(made.lists);
  numbers[i++] = static_cast<double>(made.supersegments);
  numbers[i++] = made.castSeconds;
  numbers[i] = made.listSeconds;
  return numbers;
}

inline std::optional<vdi::MadeVdi> lastVdiOf(const LastVdiNumbers& numbers) {
  vdi::MadeVdi made;
  made.settings.width = static_cast<int>(numbers[0]);
  made.settings.height = static_cast<int>(numbers[1]);
  std::size_t i = 2;
  for (const vdi::Setting& setting : vdi::settingsTable()) setting.put(made.settings, numbers[i++]);
  made.lists = static_cast<std::uint64_t>(numbers[i++]);
  made.supersegments = static_cast<std::uint64_t>(numbers[i++]);
  made.castSeconds = numbers[i++];
  made.listSeconds = numbers[i];
  if (made.lists == 0) return std::nullopt;
  return made;
}

}  // namespace pv

#endif
