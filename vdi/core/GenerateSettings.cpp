#include "vdi/core/GenerateSettings.h"

#include <cmath>
#include <limits>
#include <string>

#include "vdi/core/EnumNames.h"

namespace vdi {

namespace {

constexpr EnumNames<Algorithm> algorithmNames{
    {{Algorithm::Merge, "merge"}, {Algorithm::Bisection, "bisection"}}};

constexpr EnumNames<Interpolation> interpolationNames{
    {{Interpolation::Linear, "linear"}, {Interpolation::Nearest, "nearest"}}};

}  // namespace

const char* toString(Algorithm algorithm) {
  return nameOf(algorithm, algorithmNames);
}

Algorithm algorithmFromString(const std::string& name) {
  return namedValue(name, "algorithm", algorithmNames);
}

const char* toString(Interpolation interpolation) {
  return nameOf(interpolation, interpolationNames);
}

Interpolation interpolationFromString(const std::string& name) {
  return namedValue(name, "interpolation", interpolationNames);
}

float terminationOpticalDepth(const GenerateSettings& settings) {
  const double opacity = settings.terminationOpacity;
  return opacity >= 1.0 ? std::numeric_limits<float>::infinity()
                        : static_cast<float>(-std::log2(1.0 - opacity));
}

}  // namespace vdi
