// Values beyond the outermost cells of the domain.
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

/// Continues a block's values into the open places outside the stored values, along each axis that
/// leads from an open place back to known values.
///
/// Along an axis, the values follow the parabola through the three nearest ones, limited so that a steep edge
/// or an extremum does not overshoot. A linear field continues linearly. If an axis has fewer than three
/// known values, the nearest one is repeated.
///
/// Cell values end half a cell before the domain does. If each level kept its outermost value over
/// that distance, levels of different spacing would show a linear field differently at the domain's
/// faces.
///
/// `patches` are some of the block's, in any order. Masked values of the block are never used.
void continueBeyondDomain(const Block& block, std::span<const OpenPatch> patches);

}  // namespace vdi::comm
