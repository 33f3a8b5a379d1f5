// The table of settings. Code that treats all settings alike is written once and reads this table: checks,
// the comparison between ranks, the options of the tool, the keys of JSON runs, and the properties of
// ParaView's filter.
#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <string_view>

#include "vdi/core/GenerateSettings.h"

namespace vdi {

/// A setting that is one number, one of several names, or a flag, as a double: an enumerator's value, 0 or 1.
/// The picture's size, the region, the lights and the isovalues are not in the table.
struct Setting {
  enum class Kind { Number, Count, Name, Flag };

  Kind kind = Kind::Number;
  const char* name = "";      // name in messages: "termination opacity"
  const char* property = "";  // property of ParaView's filter: "TerminationOpacity"
  const char* key = "";       // key of JSON runs: "termination_opacity"
  const char* help = "";      // help on the tool's option, whose name is optionOf(*this)
  double low = 0.0;           // the range, [low, high]
  double high = 1.0;
  bool excludesLow = false;                                     // (low, high]
  double automatic = std::numeric_limits<double>::quiet_NaN();  // a valid value outside the range; NaN: none
  /// For Kind::Name: the name of an enumerator in [0, high], and the enumerator of a name. The latter throws
  /// Error{InvalidArgument} that lists the valid names.
  const char* (*nameOf)(double) = nullptr;
  double (*named)(const std::string&) = nullptr;

  double (*get)(const GenerateSettings&) = nullptr;
  /// Clamps the value to the range of the member's type.
  void (*put)(GenerateSettings&, double) = nullptr;

  /// "0.5" or "merge".
  std::string text(double value) const;
  /// Throws Error{InvalidArgument} that names the setting, the value and the range.
  void check(double value) const;
  /// Calls check, then put.
  void set(GenerateSettings& settings, double value) const;
};

inline constexpr std::size_t settingCount = 12;
std::span<const Setting, settingCount> settingsTable();
/// The index of a setting by its property's name, which must be in the table.
std::size_t indexOfSetting(std::string_view property);
/// "--termination-opacity"
std::string optionOf(const Setting& setting);

/// Checks all settings. Throws Error{InvalidArgument} naming the setting, its value and its range.
void validate(const GenerateSettings& settings);

}  // namespace vdi
