// Shading on the CPU (vdi/core/Shading.h). Twin of shaders/shading.glsl.
#pragma once

#include <glm/glm.hpp>

#include "vdi/core/Block.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/core/Shading.h"

namespace vdi::reference {

/// Direction of the scalar's gradient at a place: a unit vector, or zero if there is no gradient.
glm::dvec3 normalAt(const Block& block, const glm::dvec3& world, Interpolation interpolation);

/// The factor by which shading multiplies a colour at a place. `rayDirection` points away from the eye and
/// has any length.
glm::vec3 lightAt(const GenerateSettings& settings, const View& view, const Block& block,
                  const glm::dvec3& world, const glm::dvec3& rayDirection);

}  // namespace vdi::reference
