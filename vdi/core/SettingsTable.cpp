#include "vdi/core/SettingsTable.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>
#include <type_traits>
#include <utility>

#include "vdi/core/Camera.h"
#include "vdi/core/Error.h"

namespace vdi {

namespace {

using Kind = Setting::Kind;

template <auto Member, auto... Inner>
auto& memberOf(auto& object) {
  if constexpr (sizeof...(Inner) == 0)
    return object.*Member;
  else
    return memberOf<Inner...>(object.*Member);
}

/// A row of the table: a member of GenerateSettings, or of one of its members.
template <auto... Members>
constexpr Setting row(Setting setting) {
  setting.get = [](const GenerateSettings& settings) {
    return static_cast<double>(memberOf<Members...>(settings));
  };
  setting.put = [](GenerateSettings& settings, double value) {
    auto& member = memberOf<Members...>(settings);
    using Member = std::remove_reference_t<decltype(member)>;
    if constexpr (!std::is_same_v<Member, double>)  // bool, std::uint32_t and enumerations of that
      value = value > 0.0 ? std::min(value, 1.0 * std::numeric_limits<std::uint32_t>::max()) : 0.0;
    member = static_cast<Member>(value);
  };
  return setting;
}

/// A row of the table for an enumeration, with its toString and its ...FromString.
template <auto Member, auto ToString, auto FromString>
constexpr Setting namedRow(Setting setting) {
  using Enum = std::remove_reference_t<decltype(std::declval<GenerateSettings>().*Member)>;
  setting.kind = Kind::Name;
  setting.nameOf = [](double value) {
    return ToString(static_cast<Enum>(static_cast<std::uint32_t>(value)));
  };
  setting.named = [](const std::string& name) { return static_cast<double>(FromString(name)); };
  return row<Member>(setting);
}

const char* nameOfBudget(Budget budget) {
  return toString(budget);
}
const char* nameOfAlgorithm(Algorithm algorithm) {
  return toString(algorithm);
}
const char* nameOfInterpolation(Interpolation interpolation) {
  return toString(interpolation);
}
const char* nameOfPrecision(Precision precision) {
  return toString(precision);
}

constexpr std::array tableRows{
    row<&GenerateSettings::margin>(
        {.name = "margin",
         .property = "Margin",
         .key = "margin",
         .help = "lists beyond each edge of the picture, as a share of its size, 0 to 4. They hold the "
                 "material that comes into view when a zoomed-in camera turns or moves",
         .high = maxMargin}),
    row<&GenerateSettings::supersegments>(
        {.kind = Kind::Count,
         .name = "supersegments",
         .property = "Supersegments",
         .key = "supersegments",
         .help = "maximum number of supersegments in a list (N_S), 1 to 1024",
         .low = 1.0,
         .high = maxSupersegments}),
    row<&GenerateSettings::samplesPerVoxel>(
        {.name = "sampling rate",
         .property = "SamplingRate",
         .key = "sampling_rate",
         .help = "samples per voxel, 1/64 to 64; 0: 1, 2 or 4, as transfer function and volume require",
         .low = 1.0 / 64.0,
         .high = 64.0,
         .automatic = automaticRate}),
    namedRow<&GenerateSettings::interpolation, nameOfInterpolation, interpolationFromString>(
        {.name = "interpolation",
         .property = "InterpolationType",
         .key = "interpolation",
         .help = "scalar between values: linear, or nearest, which shows each voxel's own value, as labels "
                 "need it"}),
    namedRow<&GenerateSettings::algorithm, nameOfAlgorithm, algorithmFromString>(
        {.name = "algorithm",
         .property = "Algorithm",
         .key = "algorithm",
         .help = "algorithm that turns samples into supersegments: merge, or bisection, which is the paper's "
                 "search"}),
    namedRow<&GenerateSettings::budget, nameOfBudget, budgetFromString>(
        {.name = "budget",
         .property = "Budget",
         .key = "budget",
         .help = "rule by which lists share supersegments: list, up to N_S each; total, as many in all, but "
                 "up to twice N_S for a list that needs them and fewer for the others"}),
    row<&GenerateSettings::fill>(
        {.name = "fill",
         .property = "Fill",
         .key = "fill",
         .help = "with --budget total: share of these supersegments to make, (0, 1]; with half of them the "
                 "picture looks nearly the same",
         .excludesLow = true}),
    namedRow<&GenerateSettings::precision, nameOfPrecision, precisionFromString>(
        {.name = "precision",
         .property = "Precision",
         .key = "precision",
         .help = "form of a supersegment: compact, 8 bytes, accurate to 1/255 from the VDI's viewpoint, "
                 "except in highlights; full, 24 bytes of floats"}),
    row<&GenerateSettings::terminationOpacity>(
        {.name = "termination opacity",
         .property = "TerminationOpacity",
         .key = "termination_opacity",
         .help = "opacity at which a ray ends, (0, 1]; the material behind is missing from other "
                 "viewpoints; 1: rays never end early",
         .excludesLow = true}),
    row<&GenerateSettings::shading, &Shading::on>(
        {.kind = Kind::Flag,
         .name = "shade",
         .property = "Shade",
         .key = "shade",
         .help = "light the volume by its gradient, seen from the viewpoint; a turned VDI keeps this light"}),
    row<&GenerateSettings::shading, &Shading::ambient>(
        {.name = "ambient",
         .property = "Ambient",
         .key = "ambient",
         .help = "with --shade: share of the colour that is visible without light, 0 to 1"}),
    row<&GenerateSettings::shading, &Shading::diffuse>(
        {.name = "diffuse",
         .property = "Diffuse",
         .key = "diffuse",
         .help = "with --shade: share of the light that the material reflects, 0 to 1"}),
};

}  // namespace

std::string Setting::text(double value) const {
  return kind == Kind::Name ? nameOf(value) : fmt::format("{:g}", value);
}

void Setting::check(double value) const {
  if (value == automatic) return;
  const auto refuse = [&](const std::string& rule) {
    throw Error(ErrorCode::InvalidArgument, fmt::format("{} must {}, but is {}", name, rule, value));
  };
  if (!((excludesLow ? value > low : value >= low) && value <= high)) {
    const auto number = [](double end) {
      return end > 0.0 && end < 1.0 ? fmt::format("1/{:g}", 1.0 / end) : fmt::format("{:g}", end);
    };
    std::string range = fmt::format("lie in {}{}, {}]", excludesLow ? "(" : "[", number(low), number(high));
    if (!std::isnan(automatic)) range += fmt::format(", or be {:g} for automatic", automatic);
    refuse(range);
  }
  if (kind != Kind::Number && value != std::floor(value)) refuse("be a whole number");
}

void Setting::set(GenerateSettings& settings, double value) const {
  check(value);
  put(settings, value);
}

void validate(const GenerateSettings& settings) {
  const auto require = [](bool good, const char* field, auto value, std::string_view range) {
    if (!good)
      throw Error(ErrorCode::InvalidArgument,
                  fmt::format("{} must lie in {}, but is {}", field, range, value));
  };
  const std::string sides = fmt::format("[1, {}]", View::maxSide);
  require(settings.width >= 1 && settings.width <= View::maxSide, "width", settings.width, sides);
  require(settings.height >= 1 && settings.height <= View::maxSide, "height", settings.height, sides);
  for (const Setting& setting : settingsTable()) setting.check(setting.get(settings));
  if (settings.budget == Budget::List && settings.fill != 1.0) {
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("a fill of {} needs the total budget", settings.fill));
  }
  if (settings.budget == Budget::Total && settings.algorithm != Algorithm::Merge) {
    throw Error(ErrorCode::InvalidArgument, "the total budget needs the merge algorithm");
  }
  validate(settings.shading);
  validate(settings.region);
  validate(settings.blending);
}

std::span<const Setting, settingCount> settingsTable() {
  return tableRows;
}

std::size_t indexOfSetting(std::string_view property) {
  const auto found =
      std::ranges::find_if(tableRows, [&](const Setting& setting) { return setting.property == property; });
  assert(found != tableRows.end());
  return static_cast<std::size_t>(found - tableRows.begin());
}

std::string optionOf(const Setting& setting) {
  std::string option = std::string("--") + setting.key;
  std::ranges::replace(option, '_', '-');
  return option;
}

}  // namespace vdi
