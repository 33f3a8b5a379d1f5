// Values beyond the outermost known ones of the domain.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "vdi/core/Block.h"

namespace vdi::comm {

/// A patch of a block, and the places in it for which no block has a value.
struct OpenPatch {
  IndexBox box;                // the patch's box
  std::byte* values;           // [size.z][size.y][size.x], of the block's type; the patch's own memory
  std::vector<IndexBox> open;  // parts of `box`, disjoint
};

/// Continues a block's values into the open places outside `core`, along each axis that leads from an open
/// place back to known values. An open place takes the mean over these axes. Places that are beside known
/// values come first, and the next ones continue from them too.
///
/// Along an axis, the values follow the parabola through the three nearest ones, limited so that a steep edge
/// or an extremum does not overshoot. A linear field continues linearly. If an axis has fewer than three
/// known values, the nearest one is repeated.
///
/// Cell values end half a cell before the domain does. If each level kept its outermost value over
/// that distance, levels of different spacing would show a linear field differently at the domain's
/// faces. Edges and corners of ghost layers beyond the domain continue from the layers' faces.
///
/// `core` are the indices of the stored values without ghost layers. Values outside `used` are never read,
/// nor are masked values of the block. `patches` are some of the block's, in any order.
void continueBeyondDomain(const Block& block, const IndexBox& core, const IndexBox& used,
                          std::span<const OpenPatch> patches);

}  // namespace vdi::comm
