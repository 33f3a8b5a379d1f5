// The guard band: lists of a VDI beyond the edges of its picture, so that what lies there is seen when the
// viewer turns or moves.
#pragma once

#include <glm/glm.hpp>

#include "vdi/core/Camera.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/core/Scene.h"

namespace vdi {

/// How many lists there are on the left and on the right of the picture (x), below and above it (y): the
/// settings' share of the picture, rounded up, but no more than
///   * the scene's box takes in the image plane, so that a scene that is wholly in the picture has no margin;
///   * what keeps samples slabs where the picture's are (samplesAreSlabs), which the picture would show.
/// Depends on nothing else: the same on all ranks. Throws as View and depthLattice do.
glm::ivec2 marginOf(const Scene& scene, const Camera& camera, const GenerateSettings& settings);

/// Of all lists that the settings ask for: the picture's and its margin's.
View viewWithMargin(const Scene& scene, const Camera& camera, const GenerateSettings& settings);

}  // namespace vdi
