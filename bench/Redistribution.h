// Moves values so that each rank owns one box, as compositing whole pictures requires.
#pragma once

#include <cstdint>
#include <vector>

#include "vdi/comm/Communicator.h"
#include "vdi/core/Block.h"

namespace vdi::bench {

struct Redistributed {
  std::vector<Block> blocks;    // this rank's, at most one
  std::uint64_t bytesSent = 0;  // from this rank to others
};

/// Cuts the lattice of all ranks' blocks at the planes of a k-d tree into one box for each rank,
/// and sends each rank its values through MPI. The resulting blocks own the boxes that
/// Block::fromPoints and fromCells define, and have their own values. Extra layers, patches and
/// masks of the given blocks are dropped. Collective. Throws Error{InvalidArgument} on all ranks
/// for blocks that do not share one lattice and scalar type.
Redistributed redistribute(const comm::Communicator& comm, const std::vector<Block>& blocks);

}  // namespace vdi::bench
