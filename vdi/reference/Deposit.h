// Deposition of particles on cells in double precision, for comparison with devices on any number of ranks.
// vdi/core/Particles.h has the rules.
#pragma once

#include <span>
#include <vector>

#include "vdi/core/Block.h"
#include "vdi/core/Particles.h"

namespace vdi::reference {

struct Deposit {
  /// Per block, one for each stored cell, ghost and hidden cells included.
  std::vector<std::vector<double>> values;
  ParticleCounts counts;
};

/// Deposits the particles on the blocks of all ranks, which are of cells. Where blocks of different spacing
/// overlap, the finest owns the place. A block's `data` isn't read.
Deposit deposit(std::span<const Block> blocks, const Particles& particles, DepositKind kind);

/// The integral of each block's values over the places that the block owns (Density), or the sum of values
/// times the share of their cell that it owns (Sum), added up over all blocks. It equals the total weight of
/// the particles that were not left out.
double totalOf(std::span<const Block> blocks, std::span<const std::vector<double>> values, DepositKind kind);

}  // namespace vdi::reference
