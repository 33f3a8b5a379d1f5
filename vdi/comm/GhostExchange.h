// Turns the blocks of all ranks into one volume: settles ownership, and fetches neighbours' values around
// each block.
#pragma once

#include <vector>

#include "vdi/comm/Communicator.h"
#include "vdi/core/Block.h"

namespace vdi::comm {

/// Collective. Gives each place one owner, for blocks of any ranks, levels and lattices.
///
/// - Where blocks of different spacing overlap, the finest owns the common part. A block that finer ones
///   cover in part becomes several blocks that share its data. A block that they cover completely is removed.
/// - Blocks of one level (a value represents the same volume, to 1 %) that overlap by more than 1e-3 of a
///   spacing on every axis cause an Error{InvalidArgument} on all ranks, which names both.
/// - Faces that differ by less than 1e-3 of a spacing become one.
///
/// Blocks that own nothing are passed through. No values are sent or copied.
std::vector<Block> settleOwnership(const Communicator& comm, std::vector<Block> blocks);

/// Collective. Calls settleOwnership, then adds neighbours' values: all that interpolation uses up to
/// valueReach beyond the owned boxes, edges and corners included. That is one layer of points, or two of
/// cells. Values arrive as `extra` layers and `patches` of the blocks; stored ones are not copied. Where all
/// values of a layer are copies from blocks of this rank, the patches name these blocks, and their data must
/// stay as long as the patches are read. Existing extra layers and patches are dropped.
///
/// Gaps. Blocks of point data that are at most one spacing apart first close the gap. The coarser block owns
/// it, or the lower one of two of the same level.
///
/// Values. Neighbours are blocks of any rank whose owned boxes contain a value's place. The finest one
/// determines the value, which is
/// - a copy, if the neighbour has a value at the place, to within 1e-3 of a spacing;
/// - for cell data, the mean over a finer neighbour's values in the volume that it represents;
/// - else interpolated trilinearly from the neighbour's values, after those around the neighbour's own box
///   have been found.
/// Integers are rounded. Where no block has a value, the nearest own value is repeated. Sides without any
/// neighbour get no layer.
///
/// Stored values outside the owned box. The caller's ghost layers count only where no block owns the place.
/// Elsewhere the owner's values replace them if interpolation would mix them with the block's own. `masked`
/// values are replaced likewise. Beyond the domain,
/// - ghost values straight beside a block (outside it along one axis only) count for all blocks. Where they
///   lie straight beside several blocks, all ranks take the finest block's; within a level, the one beside
///   which they lie along x, then y, then z. Other blocks take none from a block that has masked values;
/// - ghost values at edges and corners are never interpolated, since many codes leave them unset. They are
///   continued from the layers' faces (BeyondDomain.h), for one block as for many.
///
/// Cells of several levels. Where no block has a value, the block's own values are continued
/// (BeyondDomain.h), so that all levels show the same field at the domain's faces.
///
/// Scalar types that differ. All blocks become f32, or f64 if one of them is u32, i32 or f64. Blocks of other
/// types are copied.
///
/// Cost. Each rank plans for its own blocks. Descriptions of all blocks are gathered, some 200 bytes each.
/// Values are requested and sent once, and once more for each level in which others interpolate. A block
/// takes time and some 120 bytes for each neighbour with values around it, of which there are thousands
/// beside finer blocks.
std::vector<Block> exchangeGhosts(const Communicator& comm, std::vector<Block> blocks);

}  // namespace vdi::comm
