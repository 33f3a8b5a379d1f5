#include "vdi/core/Blending.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "vdi/core/EnumNames.h"
#include "vdi/core/Error.h"
#include "vdi/core/TransferFunction.h"

namespace vdi {

namespace {

constexpr EnumNames<BlendMode, 4> blendModeNames{{{BlendMode::Composite, "composite"},
                                                  {BlendMode::Maximum, "maximum"},
                                                  {BlendMode::Minimum, "minimum"},
                                                  {BlendMode::Isosurface, "isosurface"}}};

}  // namespace

const char* toString(BlendMode mode) {
  return nameOf(mode, blendModeNames);
}

BlendMode blendModeFromString(const std::string& name) {
  return namedValue(name, "blend mode", blendModeNames);
}

std::vector<Isosurface> isosurfacesOf(const Blending& blending, const TransferTable& table) {
  if (blending.mode != BlendMode::Isosurface) return {};
  std::vector<double> sorted = blending.isovalues;
  std::ranges::sort(sorted);
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  std::vector<Isosurface> surfaces;
  for (const double value : sorted) {
    const double position = table.positionOf(value);
    surfaces.push_back({position, table.materialAt(position)});
  }
  return surfaces;
}

void validate(const Blending& blending) {
  const auto refuse = [](const std::string& what) { throw Error(ErrorCode::InvalidArgument, what); };
  const std::size_t count = blending.isovalues.size();
  if (blending.mode != BlendMode::Isosurface) {
    if (count > 0)
      refuse(fmt::format("isovalues need blend mode isosurface, not {}", toString(blending.mode)));
    return;
  }
  if (count == 0) refuse("blend mode isosurface needs at least one isovalue");
  if (count > maxIsovalues)
    refuse(fmt::format("a picture shows at most {} isovalues, but {} were given", maxIsovalues, count));
  for (const double value : blending.isovalues) {
    if (!std::isfinite(value)) refuse(fmt::format("an isovalue must be finite, but is {}", value));
  }
}

void requireComposite(const Blending& blending) {
  if (blending.mode == BlendMode::Composite) return;
  throw Error(ErrorCode::InvalidArgument,
              fmt::format("a VDI holds only composite blending, and the blend mode is {}: choose composite, "
                          "or a picture without a VDI",
                          toString(blending.mode)));
}

}  // namespace vdi
