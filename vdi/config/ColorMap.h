// Colour maps from ParaView's preset files (Color Map Editor ▸ Export), without VTK.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "vdi/core/ScalarRange.h"
#include "vdi/core/TransferFunction.h"
#include "vdi/io/Json.h"

namespace vdi::config {

/// A piecewise linear map between nodes in ascending order of x. A map that isn't linear in RGB is sampled.
struct ColorMap {
  std::vector<ColorNode> colors;       // at least two, not all at the same x
  std::vector<OpacityNode> opacities;  // at least two, or none if the preset has no opacities
};

/// The limits of a preset file, which may have many presets with a node for each of 256 colours.
inline constexpr io::JsonLimits presetLimits{
    .bytes = std::size_t{16} << 20, .depth = 16, .values = std::size_t{1} << 20};

/// The preset with this name, or the file's only one if `name` is empty. Throws Error{Format} with the place
/// for JSON that isn't a preset, a preset of categories, and a colour space other than RGB, HSV, Lab,
/// Diverging and Step.
ColorMap colorMapOf(std::string_view text, const std::string& file, const std::string& name);

/// ParaView's "Cool to Warm", over [0, 1].
ColorMap coolToWarm();

/// The map with its first and last nodes, of colours and of opacities, moved to the ends of `range`, which
/// has a width.
ColorMap rescaled(ColorMap map, const ScalarRange& range);

}  // namespace vdi::config
