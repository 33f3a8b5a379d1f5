// The faces of a VDI's box, where its lists begin and end.
#pragma once

#include <array>
#include <glm/glm.hpp>

#include "vdi/core/Box.h"
#include "vdi/core/Camera.h"

namespace vdi {

/// The six faces of a box in a view's view space: the box is where dot(xyz, p) >= w for each of them. xyz has
/// length 1. An empty box counts as all space: its faces are (0, 0, 0, -1).
using BoxFaces = std::array<glm::dvec4, 6>;
BoxFaces facesOf(const Box& box, const View& view);

/// The largest rounding error of a list's end, which lies on a face: `depth` along the view's axis, and
/// `distance` from the face.
struct FaceTolerance {
  double depth = 0.0;
  double distance = 0.0;
};
/// The tolerance for lists whose depths are at most `farthest`. `depthStep` is DepthCode's step, or 0.
FaceTolerance faceToleranceOf(double depthStep, double farthest);

}  // namespace vdi
