// The value of a block at any place.
#pragma once

#include <glm/glm.hpp>

#include "vdi/core/Block.h"

namespace vdi::reference {

/// Trilinear, among all values that the block has; beyond the outermost ones, clamped to these.
double interpolate(const Block& block, const glm::dvec3& world);

}  // namespace vdi::reference
