// The guard band: lists of a VDI beyond the edges of its picture, which become visible when the viewer turns
// or moves.
#pragma once

#include <glm/glm.hpp>

#include "vdi/core/Camera.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/core/Scene.h"

namespace vdi {

/// The number of lists on each side of the picture, left and right (x), below and above (y): the settings'
/// share of the picture, rounded up, but no more than
///   * the extent of the scene's box in the image plane, so that a scene wholly in the picture has no margin;
///   * the largest margin for which samples are slabs, if the picture's samples are slabs (samplesAreSlabs);
///     a larger one would change the picture.
/// It depends only on the arguments, so all ranks get the same margin. Throws as View and depthLattice do.
glm::ivec2 marginOf(const Scene& scene, const Camera& camera, const GenerateSettings& settings);

/// The view of all lists that the settings ask for: the picture and its margin.
View viewWithMargin(const Scene& scene, const Camera& camera, const GenerateSettings& settings);

}  // namespace vdi
