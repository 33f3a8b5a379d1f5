// The value of a block at any place.
#pragma once

#include <glm/glm.hpp>

#include "vdi/core/Block.h"
#include "vdi/core/GenerateSettings.h"

namespace vdi::reference {

/// The trilinear or the nearest value at a place, among all values of the block; places beyond the outermost
/// values are clamped to them.
double interpolate(const Block& block, const glm::dvec3& world,
                   Interpolation interpolation = Interpolation::Linear);

}  // namespace vdi::reference
