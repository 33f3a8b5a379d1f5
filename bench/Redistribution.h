// Moves blocks to ranks that own a box each: what compositing of whole pictures needs first.
#pragma once

#include <cstdint>
#include <vector>

#include "vdi/comm/Communicator.h"
#include "vdi/core/Block.h"

namespace vdi::bench {

struct Redistributed {
  std::vector<Block> blocks;    // this rank's, one or none
  std::uint64_t bytesSent = 0;  // from this rank to others
};

/// Cuts the lattice that the blocks of all ranks are parts of at the planes of a k-d tree, one box for each
/// rank, and sends each rank its values through MPI. Blocks own what Block::fromPoints and fromCells say, and
/// have values of their own; extra layers, patches and masks of the given ones are left out. Collective.
/// Throws Error{InvalidArgument} on all ranks for blocks that aren't of one lattice and scalar type.
Redistributed redistribute(const comm::Communicator& comm, const std::vector<Block>& blocks);

}  // namespace vdi::bench
