#include "vdi/core/BoxFaces.h"

#include <cstddef>

namespace vdi {

BoxFaces facesOf(const Box& box, const View& view) {
  BoxFaces faces;
  faces.fill({0.0, 0.0, 0.0, -1.0});
  if (box.empty()) return faces;
  std::size_t first = 0;
  for (int axis = 0; axis < 3; ++axis, first += 2) {
    const glm::dvec3 normal(view.right()[axis], view.up()[axis], view.forward()[axis]);
    faces[first] = {normal, glm::dot(normal, view.toView(box.lo))};
    faces[first + 1] = {-normal, -glm::dot(normal, view.toView(box.hi))};
  }
  return faces;
}

FaceTolerance faceToleranceOf(double depthStep, double farthest) {
  constexpr double rounding = 4e-6;  // relative error of floats along a ray
  return {depthStep + rounding * farthest, rounding * farthest};
}

}  // namespace vdi
