#include "vdi/config/Presets.h"

#include <utility>

#include "vdi/core/Error.h"

namespace vdi::config {

namespace {

/// A function over [0, 1].
TransferFunction threeHues() {
  return {{{0.0, {0.10, 0.15, 0.60}}, {0.5, {0.90, 0.85, 0.45}}, {1.0, {0.75, 0.10, 0.10}}},
          {{0.0, 0.0}, {0.33, 0.0}, {0.6, 0.2}, {1.0, 0.9}},
          1.0};
}

TransferFunction haze() {
  return {{{0.0, {0.35, 0.45, 0.60}}, {1.0, {1.0, 1.0, 1.0}}}, {{0.0, 0.0}, {1.0, 0.12}}, 1.0};
}

TransferFunction bands() {
  constexpr double halfWidth = 0.02;
  const std::vector<ColorNode> hues{{0.2, {0.15, 0.35, 0.85}},
                                    {0.4, {0.10, 0.70, 0.65}},
                                    {0.6, {0.95, 0.80, 0.20}},
                                    {0.8, {0.85, 0.20, 0.15}}};
  TransferFunction function{hues, {}, 1.0};
  for (const ColorNode& hue : hues) {
    function.opacities.push_back({hue.x - halfWidth, 0.0});
    function.opacities.push_back({hue.x, 0.6});
    function.opacities.push_back({hue.x + halfWidth, 0.0});
  }
  return function;
}

TransferFunction surface() {
  return {{{0.45, {0.55, 0.40, 0.30}}, {0.6, {0.95, 0.85, 0.70}}, {1.0, {1.0, 1.0, 1.0}}},
          {{0.45, 0.0}, {0.5, 0.95}, {1.0, 1.0}},
          1.0};
}

/// The range to which [0, 1] is stretched.
ScalarRange widened(const ScalarRange& range) {
  if (!(range.min <= range.max)) return {0.0, 1.0};
  return range.min < range.max ? range : ScalarRange{range.min, range.min + 1.0};
}

}  // namespace

TransferFunction stretched(TransferFunction function, const ScalarRange& range) {
  const ScalarRange wide = widened(range);
  const auto at = [&](double share) { return wide.min * (1.0 - share) + wide.max * share; };
  for (ColorNode& node : function.colors) node.x = at(node.x);
  for (OpacityNode& node : function.opacities) node.x = at(node.x);
  return function;
}

const std::vector<PresetInfo>& transferFunctionPresets() {
  static const std::vector<PresetInfo> infos{
      {"three-hues", "blue, yellow, red; clear below a third, nearly opaque at the top"},
      {"haze", "bluish to white, thin everywhere: no ray ends early"},
      {"bands", "four narrow bands of different hues"},
      {"surface", "clear below the middle of the range, opaque above"},
  };
  return infos;
}

TransferFunction presetTransferFunction(const std::string& name, const ScalarRange& range,
                                        double unitDistance) {
  TransferFunction function;
  if (name == "three-hues") {
    function = threeHues();
  } else if (name == "haze") {
    function = haze();
  } else if (name == "bands") {
    function = bands();
  } else if (name == "surface") {
    function = surface();
  } else {
    std::string names;
    for (const PresetInfo& info : transferFunctionPresets()) names += (names.empty() ? "" : ", ") + info.name;
    throw Error(ErrorCode::InvalidArgument, "no transfer function '" + name + "'; use one of " + names);
  }
  function.unitDistance = unitDistance;
  return stretched(std::move(function), range);
}

}  // namespace vdi::config
