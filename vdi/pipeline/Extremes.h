// Pictures of the extreme scalars along rays (vdi/core/Blending.h). Not part of the library's interface.
#pragma once

#include <cstdint>
#include <span>

#include "vdi/core/Blending.h"
#include "vdi/core/Image.h"
#include "vdi/core/TransferFunction.h"

namespace vdi::detail {

/// Colours a picture, all of whose pixels it sets. `keys` [height][width] are the largest values of
/// extremeKey (shaders/blending.glsl) over all ranks. The high word grows with the scalar's position in the
/// table (Maximum) or with its negative (Minimum), the low one with nearness.
void colorExtremes(std::span<const std::uint64_t> keys, BlendMode mode, const TransferTable& table,
                   Image& image);

}  // namespace vdi::detail
