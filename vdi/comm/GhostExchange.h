// Fills in what's missing between blocks: ghost layers, over all blocks of all ranks.
#pragma once

#include <vector>

#include "vdi/comm/Communicator.h"
#include "vdi/core/Block.h"

namespace vdi::comm {

/// Collective. For each block whose values end where a neighbour's begin one spacing further (point data cut
/// with a gap of one cell, or cell data without ghost cells), returns a copy with one layer of the
/// neighbour's values on that side; blocks that lack nothing are passed through untouched (no copy).
/// Neighbours are blocks of any rank with the same scalar type, the same spacing and lattice positions that
/// differ by whole numbers of spacings, to within 1e-3 of one. Where layers are added but some values of the
/// layer have no donor (edge of the domain, a missing corner), the nearest own value fills them. Owned boxes:
/// for a gap of one cell of point data the lower block's owned box grows upward by that cell, so that the gap
/// has exactly one owner; cell data keeps its boxes. Blocks that already have ghost layers are only donors of
/// their owned values, and keep their layers. Works for any number of ranks, 1 included; cost: one allGather
/// of block descriptions, one allToAll of values.
std::vector<Block> exchangeGhosts(const Communicator& comm, std::vector<Block> blocks);

}  // namespace vdi::comm
