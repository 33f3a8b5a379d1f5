#include "VDIPlace.h"

#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkNew.h>

#include <algorithm>
#include <cstddef>
#include <limits>

namespace pv {

namespace {

constexpr const char* cameraName = "VDI.camera";
constexpr const char* boundsName = "VDI.bounds";

double* addNumbers(vtkFieldData* fields, const char* name, vtkIdType count) {
  vtkNew<vtkDoubleArray> array;
  array->SetName(name);
  array->SetNumberOfTuples(count);
  fields->AddArray(array);
  return array->GetPointer(0);
}

/// Null if the array is missing, or if its count differs.
const double* numbersIn(vtkFieldData* fields, const char* name, vtkIdType count) {
  auto* array = fields != nullptr ? vtkDoubleArray::SafeDownCast(fields->GetAbstractArray(name)) : nullptr;
  return array != nullptr && array->GetNumberOfValues() == count ? array->GetPointer(0) : nullptr;
}

double depthOfMiddle(const vdi::View& view, const vdi::Box& bounds) {
  double nearest = std::numeric_limits<double>::infinity();
  double farthest = -nearest;
  for (unsigned int corner = 0; corner < 8; ++corner) {
    glm::dvec3 at;
    for (int axis = 0; axis < 3; ++axis)
      at[axis] = (corner >> static_cast<unsigned int>(axis) & 1U) != 0 ? bounds.hi[axis] : bounds.lo[axis];
    nearest = std::min(nearest, view.depthOf(at));
    farthest = std::max(farthest, view.depthOf(at));
  }
  if (view.parallel()) return 0.5 * (nearest + farthest);
  return farthest > 0.0 ? 0.5 * (std::max(nearest, 0.0) + farthest) : view.depthOf(view.camera().focalPoint);
}

}  // namespace

void setPlace(vtkFieldData* fields, const vdi::Camera& camera, const vdi::Box& bounds) {
  double* numbers = addNumbers(fields, cameraName, 12);
  double* sides = addNumbers(fields, boundsName, 6);
  for (int axis = 0; axis < 3; ++axis) {
    numbers[axis] = camera.position[axis];
    numbers[3 + axis] = camera.focalPoint[axis];
    numbers[6 + axis] = camera.viewUp[axis];
    const std::ptrdiff_t side = std::ptrdiff_t{2} * axis;
    sides[side] = bounds.lo[axis];
    sides[side + 1] = bounds.hi[axis];
  }
  numbers[9] = camera.viewAngle;
  numbers[10] = camera.parallelProjection ? 1.0 : 0.0;
  numbers[11] = camera.parallelScale;
}

std::optional<vdi::Box> boxIn(vtkFieldData* fields) {
  const double* sides = numbersIn(fields, boundsName, 6);
  if (sides == nullptr) return std::nullopt;
  const vdi::Box box{{sides[0], sides[2], sides[4]}, {sides[1], sides[3], sides[5]}};
  if (glm::any(glm::greaterThan(box.lo, box.hi))) return std::nullopt;
  return box;
}

std::optional<vdi::Camera> cameraIn(vtkFieldData* fields) {
  const double* numbers = numbersIn(fields, cameraName, 12);
  if (numbers == nullptr) return std::nullopt;
  const auto vector = [numbers](int first) {
    return glm::dvec3(numbers[first], numbers[first + 1], numbers[first + 2]);
  };
  return vdi::Camera{.position = vector(0),
                     .focalPoint = vector(3),
                     .viewUp = vector(6),
                     .viewAngle = numbers[9],
                     .parallelProjection = numbers[10] != 0.0,
                     .parallelScale = numbers[11]};
}

std::array<glm::dvec3, 4> cornersOf(const vdi::View& view, const vdi::Box& bounds) {
  const double depth = depthOfMiddle(view, bounds);
  const auto corner = [&](double x, double y) {
    const vdi::Ray ray = view.rayThrough(x, y);
    return ray.origin + depth * ray.direction;
  };
  const double width = view.width();
  const double height = view.height();
  return {corner(0.0, 0.0), corner(width, 0.0), corner(width, height), corner(0.0, height)};
}

}  // namespace pv
