#include "vdi/core/GenerateSettings.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <string>
#include <string_view>

#include "vdi/core/Camera.h"
#include "vdi/core/EnumNames.h"
#include "vdi/core/Error.h"
#include "vdi/core/SettingsTable.h"

namespace vdi {

namespace {

constexpr EnumNames<Algorithm> algorithmNames{
    {{Algorithm::Merge, "merge"}, {Algorithm::Bisection, "bisection"}}};

}  // namespace

const char* toString(Algorithm algorithm) {
  return nameOf(algorithm, algorithmNames);
}

Algorithm algorithmFromString(const std::string& name) {
  return namedValue(name, "algorithm", algorithmNames);
}

void validate(const GenerateSettings& settings) {
  const auto require = [](bool good, const char* field, auto value, std::string_view range) {
    if (!good)
      throw Error(ErrorCode::InvalidArgument,
                  fmt::format("{} must lie in {}, it is {}", field, range, value));
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

float terminationOpticalDepth(const GenerateSettings& settings) {
  const double opacity = settings.terminationOpacity;
  return opacity >= 1.0 ? std::numeric_limits<float>::infinity()
                        : static_cast<float>(-std::log2(1.0 - opacity));
}

}  // namespace vdi
