// Makes blocks of all ranks one volume: who owns what, and the values beside each block that others
// have.
#pragma once

#include <vector>

#include "vdi/comm/Communicator.h"
#include "vdi/core/Block.h"

namespace vdi::comm {

/// Collective. Gives each place one owner, for blocks of any ranks, levels and lattices.
///
/// - Of blocks of different spacing that overlap, the finest owns what they share. A block that finer
///   ones cover in part becomes several that share its data. One that is covered whole goes.
/// - Blocks of one level (a value stands for the same volume, to 1 %) that overlap by more than 1e-3 of
///   a spacing on every axis are an Error{InvalidArgument} on all ranks that names both.
/// - Faces that differ by less than 1e-3 of a spacing become one.
///
/// Blocks that own nothing are passed through. No values travel or are copied.
std::vector<Block> settleOwnership(const Communicator& comm, std::vector<Block> blocks);

/// Collective. settleOwnership, and what blocks need of their neighbours' values: all that is
/// interpolated up to valueReach beyond the owned boxes, edges and corners included: one layer of points,
/// two of cells. It comes as
/// `extra` layers and `patches` of the blocks; what is stored isn't copied. Extra layers and patches
/// that blocks have already are dropped.
///
/// Gaps. Blocks of point data that are at most one spacing apart close the gap first. The coarser one
/// owns it, of two of one level the lower one.
///
/// Values. Neighbours are blocks of any rank whose owned boxes lie at a value's place. The finest
/// counts. A value is
/// - a copy, where the neighbour has one at the place, to within 1e-3 of a spacing;
/// - for cell data, the mean over a finer neighbour's values in the volume that it stands for;
/// - else interpolated trilinearly in the neighbour's values, for which those beside its own box are
///   found first.
/// Integers are rounded. Where no block owns a place, a neighbour's ghost value counts, if that
/// neighbour has no masked values. Else the nearest own value goes on. Sides without any neighbour
/// get no layer.
///
/// Cells of several levels. Where no block has a value, the block's own values are continued
/// (BeyondDomain.h), so that all levels show the same field at the domain's faces.
///
/// Stored values that aren't the block's own. The caller's ghost layers count only where no block
/// owns the place. Elsewhere the owner's values replace them, where they would be interpolated with
/// the block's own. `masked` values are replaced likewise.
///
/// Scalar types that differ. All blocks become f32, or f64 if one of them is u32, i32 or f64. Then
/// blocks of other types are copies.
///
/// Cost. Each rank plans for its own blocks. Descriptions of all blocks are gathered, some 200 bytes
/// each. Values are asked for and sent once, and once more for each level that others interpolate in.
std::vector<Block> exchangeGhosts(const Communicator& comm, std::vector<Block> blocks);

}  // namespace vdi::comm
