// Blend modes: how the scalars along a ray become a pixel. A VDI holds only composite blending; pictures of
// the volume show all modes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

namespace vdi {

struct TransferTable;

enum class BlendMode : std::uint32_t {
  Composite = 0,  // emission and absorption, front to back
  Maximum = 1,    // colour and opacity of the ray's largest scalar
  Minimum = 2,    // colour and opacity of its smallest scalar
  Isosurface = 3  // colour and opacity of each isovalue that the ray crosses, front to back
};

const char* toString(BlendMode mode);  // "composite", "maximum", "minimum", "isosurface"
/// Throws Error{InvalidArgument} that lists the valid names.
BlendMode blendModeFromString(const std::string& name);

inline constexpr std::size_t maxIsovalues = 16;

/// The blend mode and its isovalues, with the rules of VTK's volume mapper: except in composite blending, the
/// opacity function alone gives a scalar's opacity, at any unit distance. Isosurfaces are shaded if shading
/// is on; maxima and minima never are. NaN is no maximum or minimum, and crosses no isovalue.
struct Blending {
  BlendMode mode = BlendMode::Composite;
  std::vector<double> isovalues;  // Isosurface: 1 .. maxIsovalues, in any order
  bool operator==(const Blending&) const = default;

  bool projects() const { return mode == BlendMode::Maximum || mode == BlendMode::Minimum; }
};

/// An isovalue as a position in the transfer table, and the premultiplied colour and opacity there.
struct Isosurface {
  double position = 0.0;
  glm::vec4 material{0.0F};
};
/// The isosurfaces in ascending order; none unless the mode is Isosurface.
std::vector<Isosurface> isosurfacesOf(const Blending& blending, const TransferTable& table);

/// Throws Error{InvalidArgument} for isovalues that are missing, too many, not finite, or unused.
void validate(const Blending& blending);

/// Throws Error{InvalidArgument} unless the mode is one that a VDI holds.
void requireComposite(const Blending& blending);

}  // namespace vdi
