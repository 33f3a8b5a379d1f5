#include "vdi/core/GenerateSettings.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <string>
#include <string_view>

#include "vdi/core/Camera.h"
#include "vdi/core/EnumNames.h"
#include "vdi/core/Error.h"

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
  require(settings.margin >= 0.0 && settings.margin <= maxMargin, "margin", settings.margin, "[0, 4]");
  require(settings.supersegments >= 1 && settings.supersegments <= maxSupersegments, "supersegments",
          settings.supersegments, "[1, 1024]");
  const double rate = settings.samplesPerVoxel;
  require(rate == automaticRate || (rate >= 1.0 / 64.0 && rate <= 64.0), "samples per voxel", rate,
          "[1/64, 64], or be 0 for automatic");
  require(settings.fill > 0.0 && settings.fill <= 1.0, "fill", settings.fill, "(0, 1]");
  if (settings.budget == Budget::List && settings.fill != 1.0) {
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("a fill of {} needs the total budget", settings.fill));
  }
  if (settings.budget == Budget::Total && settings.algorithm != Algorithm::Merge) {
    throw Error(ErrorCode::InvalidArgument, "the total budget needs the merge algorithm");
  }
  require(settings.terminationOpacity > 0.0 && settings.terminationOpacity <= 1.0, "termination opacity",
          settings.terminationOpacity, "(0, 1]");
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
