// Particles that are deposited on cells, and how their weight spreads.
//
// Each particle spreads its weight around its position. The block that owns the position gives the spacing:
//
// - Cloud in cell (Hockney and Eastwood 1988): the weight fills a box of the spacing's size around the
//   position. A cell gets the share of the box that lies in it. In cells of the block's own lattice these are
//   the products of linear weights.
// - SPH: the cubic spline M4 with support 2 h in three dimensions (Monaghan 1992, Annu. Rev. Astron.
//   Astrophys. 30, 543), taken at the centres of cells. Cells larger than the owner's are first divided into
//   equal parts of about the size of the owner's cells, and get the mean of the parts.
//
// Along a periodic axis, the blocks of all ranks are one period. Positions are wrapped into it, and the
// weight that leaves it at one side enters at the other.
//
// A particle's shares are divided by their sum over all owned cells of all blocks, so none of its weight is
// lost at the domain's faces, between levels, or by coarse sampling of the kernel.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace vdi {

/// Numbers `stride` bytes apart, of f32 or f64 in native byte order, not necessarily aligned. A stride of 0
/// repeats the first number.
struct NumberColumn {
  const std::byte* first = nullptr;
  std::int64_t stride = 0;
  bool isDouble = true;

  explicit operator bool() const { return first != nullptr; }
  double at(std::size_t index) const {
    const std::byte* from = first + static_cast<std::int64_t>(index) * stride;
    if (isDouble) {
      double value = 0.0;
      std::memcpy(&value, from, sizeof value);
      return value;
    }
    float value = 0.0F;
    std::memcpy(&value, from, sizeof value);
    return static_cast<double>(value);
  }
};

/// A rank's particles. The caller owns the memory.
struct Particles {
  std::size_t count = 0;
  std::array<NumberColumn, 3> positions;  // x, y, z in the world
  NumberColumn weights;                   // null: 1 each
  NumberColumn lengths;                   // smoothing lengths h in the world; null: cloud in cell for all
  std::array<bool, 3> periodic{};         // per axis; equal on all ranks
};

/// A coordinate within the period [lo, hi) that it repeats in.
inline double wrapped(double at, double lo, double hi) {
  const double periods = (at - lo) / (hi - lo);
  const double within = lo + (periods - std::floor(periods)) * (hi - lo);
  return at >= lo && at < hi ? at : within < hi ? within : lo;
}
/// The most periods by which a particle's spread is repeated to each side. Longer kernels are flat.
constexpr int mostPeriods = 4;

/// The value of a cell: the weight in it, or this weight divided by the cell's volume.
enum class DepositKind { Sum, Density };

/// Numbers of particles.
struct ParticleCounts {
  std::uint64_t given = 0;
  std::uint64_t notFinite = 0;  // left out: position or weight is NaN or infinite
  std::uint64_t outside = 0;    // left out: no block owns the position
  std::uint64_t badLength = 0;  // deposited by cloud in cell: h is not a finite number above 0
  bool operator==(const ParticleCounts&) const = default;
};

/// The kernel is used if h is at least this many times the largest edge of the owner's cells, and cloud in
/// cell below. At that length both spread about equally wide: their standard deviations along an axis,
/// sqrt(1/6) cells and 0.5477 h, agree at 0.745. A shorter kernel could miss the centres of all cells.
inline constexpr double shortestKernel = 0.75;

/// A kernel is replaced by cloud in cell if its shares add up to less than this times the share that a cell
/// of the owner's size would get at the kernel's centre. This happens only where the owner owns a small part
/// of its cell, and no other centre is near.
inline constexpr double leastKernelSum = 1.0 / 16.0;

/// A larger cell is divided into at most this many parts per axis.
inline constexpr int mostKernelParts = 1023;

}  // namespace vdi
