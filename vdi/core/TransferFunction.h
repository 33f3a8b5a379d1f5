// Transfer functions: scalar -> colour and opacity per unit distance, like vtkColorTransferFunction and
// vtkPiecewiseFunction with vtkVolumeProperty::ScalarOpacityUnitDistance.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <string>
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

/// A stretch of a transfer function along which associated colour and extinction are linear in the scalar. It
/// ends where the next one starts.
struct TransferPiece {
  float start = 0.0F;     // position in the table, as the device has it
  glm::vec4 front{0.0F};  // associated colour and extinction at its start
  glm::vec4 back{0.0F};   // the same at its end
  bool operator==(const TransferPiece&) const = default;
};

/// Beyond any position: the first piece starts, and the last one ends, that far from 0. Also the limit of the
/// device's positions.
inline constexpr double farPosition = 1e30;

/// The index of the piece at a position. Requires pieces.
std::size_t pieceAt(const std::vector<TransferPiece>& pieces, double position);

/// The function as lookups read it, in one of two forms. Both are constant outside the nodes.
///
/// - Entries: even samples from `min` to `max`, linear in between. Most functions have this form. A lookup of
///   the device is one filtered fetch.
/// - Pieces: stretches of any length, for functions with features that even samples can't resolve, such as
///   steps at large label ids, ramps of 1e-5 of the range, or many decades. A lookup searches the pieces.
///
/// A *position* in the table is a scalar in units of entries: 0 is `min`, positions - 1 is `max`. With
/// pieces, `min` is the scalar between the outermost nodes that is nearest to 0, because floats are most
/// exact there, and positions may be negative.
struct TransferTable {
  double min = 0.0;
  double max = 1.0;  // > min
  double unitDistance = 1.0;
  std::size_t positions = 2;                // >= 2
  std::vector<TransferTableEntry> entries;  // [positions], or empty
  std::vector<glm::vec4> means;  // [positions - 1]: the function's mean from each entry to the next
  /// In ascending order, or empty. The first one starts, and the last one ends, far beyond any scalar.
  std::vector<TransferPiece> pieces;
  /// Scalars of nodes whose material no value on the device shows, because 32-bit floats can't tell them
  /// from others'.
  std::vector<double> lost;

  double last() const { return static_cast<double>(positions - 1); }
  /// Does not clamp, but stays finite for infinite scalars; NaN for NaN.
  double positionOf(double scalar) const;
  /// The entry at a position; transparent for NaN.
  TransferTableEntry at(double position) const;
  /// Premultiplied colour and opacity of unitDistance of the material at a position, as the function has
  /// them; transparent for NaN.
  glm::vec4 materialAt(double position) const;
  TransferTableEntry lookup(double scalar) const { return at(positionOf(scalar)); }
  bool operator==(const TransferTable&) const = default;
};

/// Makes the form with entries if it shows the function: then there are a power of two from 1024 to 16384
/// entries, at least two between neighbouring nodes, and sixteen if there are steps. From the scalar of a
/// step on, both forms have the values behind the step. Up to the step, pieces have the values in front of
/// it, and entries up to one entry before.
TransferTable bake(const TransferFunction& transferFunction);

/// A sentence about the nodes that the table has lost; empty if it shows all of the function.
std::string describeLoss(const TransferFunction& transferFunction);

}  // namespace vdi
