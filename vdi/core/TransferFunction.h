// Transfer functions: scalar -> colour and opacity per unit distance, like vtkColorTransferFunction and
// vtkPiecewiseFunction with vtkVolumeProperty::ScalarOpacityUnitDistance.
#pragma once

#include <glm/glm.hpp>
#include <vector>

namespace vdi {

struct ColorNode {
  double x = 0.0;         // scalar
  glm::dvec3 color{0.0};  // straight RGB in [0, 1]
  bool operator==(const ColorNode&) const = default;
};

struct OpacityNode {
  double x = 0.0;        // scalar
  double opacity = 0.0;  // in [0, 1], accumulated over unitDistance of material
  bool operator==(const OpacityNode&) const = default;
};

/// Piecewise linear in both parts, constant beyond the outermost nodes. Two nodes with equal x make a step.
/// Nodes are in ascending order of x.
struct TransferFunction {
  std::vector<ColorNode> colors;
  std::vector<OpacityNode> opacities;
  double unitDistance = 1.0;  // world units, > 0

  bool operator==(const TransferFunction&) const = default;

  glm::dvec3 colorAt(double x) const;
  double opacityAt(double x) const;
};

/// Throws Error{InvalidArgument} for: no nodes, nodes out of order, values outside [0, 1] or not finite, a
/// unit distance <= 0.
void validate(const TransferFunction& transferFunction);

/// One entry of the table that both the reference and the shaders read. `extinction` is -log2(1 - opacity)
/// per unit distance, so a sample of length d has alpha = 1 - exp2(-extinction * d / unitDistance). Opacity 1
/// is stored as an extinction of maxExtinction, which is opaque for any practical length. The colour is
/// associated: straight colour times extinction, so that means of entries have the colour of what is visible.
struct TransferTableEntry {
  float red = 0.0F;
  float green = 0.0F;
  float blue = 0.0F;
  float extinction = 0.0F;
  glm::vec4 vector() const { return {red, green, blue, extinction}; }
  bool operator==(const TransferTableEntry&) const = default;
};

inline constexpr float maxExtinction = 65504.0F;  // the largest half float

/// The function sampled at `entries.size()` evenly spaced scalars from `min` to `max`, linear in between,
/// constant outside. A *position* in the table is a scalar in units of entries: 0 is `min`, entries.size() -
/// 1 is `max`.
struct TransferTable {
  double min = 0.0;
  double max = 1.0;  // > min
  double unitDistance = 1.0;
  std::vector<TransferTableEntry> entries;  // at least 2

  /// Does not clamp, but stays finite for infinite scalars; NaN for NaN.
  double positionOf(double scalar) const;
  /// The entry at a position; transparent for NaN.
  TransferTableEntry at(double position) const;
  /// Premultiplied colour and opacity of unitDistance of the material at a position, as the function has
  /// them; transparent for NaN.
  glm::vec4 materialAt(double position) const;
  TransferTableEntry lookup(double scalar) const { return at(positionOf(scalar)); }
  bool operator==(const TransferTable&) const = default;
  /// Whether some scalar in [lo, hi] has opacity > 0. Empty-space skipping uses this.
  bool visible(double lo, double hi) const;
};

/// Samples the function. The size is a power of two from 1024 to 16384, large enough for two entries between
/// neighbouring nodes where possible. Where it isn't, the range leaves out the ends at which the function is
/// constant or transparent; if that isn't enough, an entry is the mean of the function around it. From the
/// scalar of a step on, the table has the values behind the step; up to one entry before, those in front.
TransferTable bake(const TransferFunction& transferFunction);

}  // namespace vdi
