// Pre-integrated classification (Engel, Kraus and Ertl, High-Quality Pre-Integrated Volume Rendering Using
// Hardware-Accelerated Pixel Shading, 2001): what a slab, the part of a ray that one sample stands for, shows
// when scalars run linearly from one value at its front to another at its back. No feature of the transfer
// function between the two is missed, however thin, and what's in front hides what's behind.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "vdi/core/Scene.h"
#include "vdi/core/TransferFunction.h"

namespace vdi {

/// A slab of the table's length.
struct Slab {
  glm::vec3 color{0.0F};  // straight
  float opticalDepth = 0.0F;
};

/// Slabs of any length, one at a time, in double precision. Premultiplied colour and opacity; positions may
/// lie outside the transfer table, and are finite.
class SlabIntegral {
 public:
  explicit SlabIntegral(const TransferTable& table);
  /// From one position to another along `length` unit distances. What's in front hides what's behind.
  glm::dvec4 between(double front, double back, double length) const;
  /// Of the mean between two different positions: nothing is in front of anything else.
  glm::dvec4 mean(double front, double back, double length) const;

 private:
  glm::dvec4 upTo(double position) const;  // the transfer table's integral from position 0 on

  std::vector<TransferTableEntry> entries_;
  std::vector<glm::dvec4> sums_;  // up to each entry
};

/// A texture of slabs of one length. One filtered look is enough for any slab. Texels are premultiplied
/// colour and opacity, whose means are right; optical depths of opaque slabs would outshine all others.
///
/// - Rows 0 .. slabSide - 1 are the square. Texel (x, y) runs from x to y, in slabSide - 1 steps over the
///   transfer table's range.
/// - Then come levels() strips of stripRows() rows: slabs whose ends are nearer than one step of the
///   square, by the position in their middle. Strip l holds those of 2^l positions of the transfer table,
///   strip 0 those of none.
///
/// A strip is cut in rows that share a texel: entry e stands in row e / slabStripStep, column
/// e % slabStripStep, and again at the end of the row before.
struct SlabTable {
  float length = 1.0F;               // of its slabs, in unit distances
  std::size_t positions = 0;         // of the transfer table: TransferTable::entries.size()
  std::vector<glm::u16vec4> texels;  // [height()][slabSide]: half floats (core/Half.h)
  glm::vec4 below{0.0F};  // slabs all below the transfer table's range: straight colour and optical depth
  glm::vec4 above{0.0F};  // and all above it

  std::size_t stripRows() const;
  std::size_t levels() const;
  std::size_t height() const;

  /// From one position in the transfer table to another. Outside its range the function is constant; a NaN at
  /// one end takes half of what's visible at the other.
  Slab between(double front, double back) const;
};

/// One step of the lattice straight ahead: what samples are long, or near that.
float slabLength(const DepthLattice& lattice, const TransferTable& table);

/// `length`: in unit distances, > 0.
SlabTable makeSlabTable(const TransferTable& table, float length);

}  // namespace vdi
