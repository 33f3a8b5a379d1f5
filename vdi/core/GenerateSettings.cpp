#include "vdi/core/GenerateSettings.h"

#include <cmath>
#include <limits>
#include <string>

#include "vdi/core/EnumNames.h"

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

float terminationOpticalDepth(const GenerateSettings& settings) {
  const double opacity = settings.terminationOpacity;
  return opacity >= 1.0 ? std::numeric_limits<float>::infinity()
                        : static_cast<float>(-std::log2(1.0 - opacity));
}

}  // namespace vdi
