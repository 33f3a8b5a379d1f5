#include "vdi/core/Supersegment.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "vdi/core/EnumNames.h"
#include "vdi/core/Scene.h"
#include "vdi/core/TransferFunction.h"

namespace vdi {

namespace {

constexpr EnumNames<Precision> precisionNames{{{Precision::Compact, "compact"}, {Precision::Full, "full"}}};

}  // namespace

const char* toString(Precision precision) {
  return nameOf(precision, precisionNames);
}

Precision precisionFromString(const std::string& name) {
  return namedValue(name, "precision", precisionNames);
}

DepthCode depthCodeFor(const DepthLattice& lattice) {
  // Rays begin and end up to half a sample off the lattice; codes at most half a sample apart keep these
  // intervals from vanishing. Codes finer than floats at that distance would add nothing.
  const double perSample = std::floor(DepthCode::largest / (lattice.count + 1.0));
  if (lattice.count == 0 || perSample < 2.0) return {};
  const double farthest = lattice.first + lattice.count * lattice.step;
  const double meaningful = std::max(2.0, std::floor(lattice.step / (farthest * 0x1p-21)));
  return {static_cast<float>(lattice.first),
          static_cast<float>(lattice.step / std::min(perSample, meaningful))};
}

float opticalDepthOfCode(std::uint32_t code) {
  static const std::array<float, 4096> table = [] {
    std::array<float, 4096> depths{};
    for (std::size_t i = 0; i < depths.size(); ++i) {
      depths[i] = static_cast<float>((std::exp2(static_cast<double>(i) * 16.0 / 4095.0) - 1.0) / 16.0);
    }
    depths[0] = 0x1p-20F;
    return depths;
  }();
  return table[code];
}

float opacityOfCode(std::uint32_t code) {
  static const std::array<float, 4096> table = [] {
    std::array<float, 4096> opacities{};
    for (std::uint32_t i = 0; i < opacities.size(); ++i) opacities[i] = opacityOf(opticalDepthOfCode(i));
    return opacities;
  }();
  return table[code];
}

float opacityOf(float opticalDepth) {
  constexpr float ln2 = 0.69314718F;
  const float x = opticalDepth * ln2;
  return x < 1e-3F ? x * (1.0F - 0.5F * x) : 1.0F - std::exp2(-opticalDepth);
}

float opticalDepthOf(float opacity) {
  if (opacity >= 1.0F) return maxExtinction;
  constexpr float perLn2 = 1.44269504F;
  const float depth =
      opacity < 1e-3F ? opacity * (1.0F + 0.5F * opacity) * perLn2 : -std::log2(1.0F - opacity);
  return std::min(depth, maxExtinction);
}

Supersegment expanded(const CompactSupersegment& segment, const DepthCode& code) {
  const float opacity = opacityOfCode(segment.opticalDepth());
  const auto color = [&](int channel) {
    return static_cast<float>(segment.color(channel)) / 255.0F * opacity;
  };
  return {code.depthOf(segment.front()), code.depthOf(segment.back()), color(0), color(1), color(2), opacity};
}

SupersegmentLists expanded(const CompactLists& lists, const DepthCode& code) {
  SupersegmentLists result;
  result.offsets = lists.offsets;
  result.segments.reserve(lists.segments.size());
  for (const CompactSupersegment& segment : lists.segments)
    result.segments.push_back(expanded(segment, code));
  return result;
}

}  // namespace vdi
