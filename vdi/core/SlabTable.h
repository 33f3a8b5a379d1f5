// Pre-integrated classification (Engel, Kraus and Ertl, High-Quality Pre-Integrated Volume Rendering Using
// Hardware-Accelerated Pixel Shading, 2001). A slab is the part of a ray that one sample represents; its
// scalars run linearly from one value at its front to another at its back. The table misses no feature of the
// transfer function between the two, however thin, and nearer material hides farther material.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "vdi/core/Scene.h"
#include "vdi/core/TransferFunction.h"

namespace vdi {

/// One slab, as long as the table's.
struct Slab {
  glm::vec3 color{0.0F};  // straight
  float opticalDepth = 0.0F;
};

/// Integrates slabs of any length, one at a time, in double precision. Results are premultiplied colour and
/// opacity. Positions must be finite, and may lie outside the transfer table.
class SlabIntegral {
 public:
  explicit SlabIntegral(const TransferTable& table);
  /// A slab from one position to another, `length` unit distances long. Nearer material hides farther
  /// material.
  glm::dvec4 between(double front, double back, double length) const;
  /// The mean between two different positions, without any occlusion.
  glm::dvec4 mean(double front, double back, double length) const;
  /// The mean's associated colour and extinction; at a single position the function's own.
  glm::dvec4 meanEntry(double front, double back) const;
  /// The integral from the second piece's start to that of the piece. Requires pieces.
  const glm::dvec4& upToPiece(std::size_t piece) const { return sums_[piece]; }

 private:
  /// The function between two entries, linear.
  struct Gap {
    glm::dvec4 front{0.0};
    glm::dvec4 back{0.0};
  };
  glm::dvec4 upTo(double position) const;  // the transfer table's integral from position 0 on
  double endOf(std::size_t piece) const;
  glm::dvec4 inPiece(std::size_t piece, double position) const;
  glm::dvec4 meanOfPieces(double low, double high) const;

  std::vector<Gap> gaps_;
  Gap ends_;  // the outermost entries
  std::vector<TransferPiece> pieces_;
  std::vector<glm::dvec4> sums_;  // up to each entry; or up to each piece, from the second one on
};

/// Slabs of one length. If the transfer table has entries, they are a texture, and one filtered fetch gives
/// any slab. Texels are premultiplied colour and opacity, which may be averaged; in a mean of optical depths,
/// opaque slabs would outweigh all others. If it has pieces, there are no texels: each slab is integrated
/// when it is needed (shaders/pieces.glsl).
///
/// - Rows 0 .. slabSide - 1 are the square. Texel (x, y) runs from x to y, in slabSide - 1 steps over the
///   transfer table's range.
/// - Below it follow levels() strips of stripRows() rows. They have the slabs whose ends are less than one
///   step of the square apart, indexed by the position of their middle. Strip l has slabs that span 2^l
///   positions of the transfer table; those of strip 0 span none.
///
/// A strip is cut into rows, of which neighbours share a texel: entry e is in row e / slabStripStep, column e
/// % slabStripStep, and again at the end of the row before.
struct SlabTable {
  float length = 1.0F;                           // length of its slabs, in unit distances
  std::size_t positions = 0;                     // TransferTable::positions
  std::vector<glm::u16vec4> texels;              // [height()][slabSide]: half floats (core/Half.h); or empty
  std::shared_ptr<const SlabIntegral> integral;  // of pieces; else null
  glm::vec4 below{0.0F};  // a slab wholly below the transfer table's range: straight colour and optical depth
  glm::vec4 above{0.0F};  // a slab wholly above it

  std::size_t stripRows() const;
  std::size_t levels() const;
  std::size_t height() const;

  /// The slab from one position in the transfer table to another. Outside its range the function is constant;
  /// a NaN at one end gives half of the material at the other.
  Slab between(double front, double back) const;
};

/// The slabs' length: one step of the lattice straight ahead, which is close to the length of every sample.
float slabLength(const DepthLattice& lattice, const TransferTable& table);

/// `length` is in unit distances, > 0.
SlabTable makeSlabTable(const TransferTable& table, float length);

}  // namespace vdi
