#include "vdi/core/BoxFaces.h"

namespace vdi {

BoxFaces facesOf(const Box& box, const View& view) {
  BoxFaces faces;
  faces.fill({0.0, 0.0, 0.0, -1.0});
  if (box.empty()) return faces;
  for (int axis = 0; axis < 3; ++axis) {
    const glm::dvec3 normal(view.right()[axis], view.up()[axis], view.forward()[axis]);
    const auto first = static_cast<std::size_t>(2 * axis);
    faces[first] = {normal, glm::dot(normal, view.toView(box.lo))};
    faces[first + 1] = {-normal, -glm::dot(normal, view.toView(box.hi))};
  }
  return faces;
}

FaceTolerance faceToleranceOf(double depthStep, double farthest) {
  constexpr double rounding = 4e-6;  // of floats along a ray
  return {depthStep + rounding * farthest, rounding * farthest};
}

}  // namespace vdi
