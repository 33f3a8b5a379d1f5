#include "VDIView.h"

#include <vtkMatrix3x3.h>
#include <vtkMatrix4x4.h>
#include <vtkOpenGLCamera.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <limits>

#include "vdi/core/Parallel.h"

namespace pv {

namespace {

ViewMatrices matricesOf(vtkRenderer* renderer) {
  vtkMatrix4x4* worldToView = nullptr;
  vtkMatrix4x4* viewToClip = nullptr;
  vtkMatrix4x4* worldToClip = nullptr;
  vtkMatrix3x3* normals = nullptr;
  auto* camera = vtkOpenGLCamera::SafeDownCast(renderer->GetActiveCamera());
  camera->GetKeyMatrices(renderer, worldToView, normals, viewToClip, worldToClip);
  return {worldToView, viewToClip};
}

}  // namespace

vdi::Box boxOf(const double* bounds) {
  return {{bounds[0], bounds[2], bounds[4]}, {bounds[1], bounds[3], bounds[5]}};
}

Viewport viewportOf(vtkRenderer* renderer) {
  Viewport port;
  renderer->GetTiledSizeAndOrigin(&port.size.x, &port.size.y, &port.corner.x, &port.corner.y);
  return port;
}

ViewMatrices::ViewMatrices(vtkRenderer* renderer) : ViewMatrices(matricesOf(renderer)) {}

ViewMatrices::ViewMatrices(vtkMatrix4x4* worldToView, vtkMatrix4x4* viewToClip) {
  // The matrices are transposed: element (i, j) is row j, column i.
  const auto toView = [&](int row, int column) { return worldToView->GetElement(column, row); };
  const auto toClip = [&](int row, int column) { return viewToClip->GetElement(column, row); };
  const glm::dvec3 right{toView(0, 0), toView(0, 1), toView(0, 2)};
  const glm::dvec3 up{toView(1, 0), toView(1, 1), toView(1, 2)};
  const glm::dvec3 back{toView(2, 0), toView(2, 1), toView(2, 2)};
  camera_.position = -(toView(0, 3) * right + toView(1, 3) * up + toView(2, 3) * back);
  camera_.focalPoint = camera_.position - back;
  camera_.viewUp = up;
  camera_.parallelProjection = toClip(3, 3) != 0.0;
  const glm::dvec2 scale{toClip(0, 0), toClip(1, 1)};
  // The middle of clip coordinates at depth 1, where view-space z is -1. In parallel projection it is the
  // same at any depth.
  const glm::dvec2 middle = camera_.parallelProjection ? glm::dvec2(toClip(0, 3), toClip(1, 3))
                                                       : -glm::dvec2(toClip(0, 2), toClip(1, 2));
  // The eye, where the lines of constant x and y of clip coordinates meet. In a stereo picture it lies beside
  // the origin of view space.
  if (!camera_.parallelProjection) {
    const glm::dvec2 eye = -glm::dvec2(toClip(0, 3), toClip(1, 3)) / scale;
    camera_.position += eye.x * right + eye.y * up;
    camera_.focalPoint = camera_.position - back;
  }
  plane_.low = (glm::dvec2(-1.0) - middle) / scale;
  plane_.high = (glm::dvec2(1.0) - middle) / scale;
  depthScale_ = toClip(2, 2);
  depthOffset_ = toClip(2, 3);
}

vdi::View ViewMatrices::view(int width, int height) const {
  return {camera_, width, height, plane_};
}

vdi::View ViewMatrices::rows(const glm::ivec2& size, int first, int count) const {
  const double height = (plane_.high.y - plane_.low.y) / size.y;  // a pixel's
  vdi::ImagePlane plane = plane_;
  plane.low.y = plane_.low.y + height * first;
  plane.high.y = plane_.low.y + height * (first + count);
  return {camera_, size.x, count, plane};
}

float ViewMatrices::depthOf(float window) const {
  if (!isObject(window)) return std::numeric_limits<float>::infinity();
  const double clip = 2.0 * window - 1.0;
  // z of clip coordinates is depthOffset - depthScale * depth; in perspective it is divided by depth.
  const double depth =
      camera_.parallelProjection ? (depthOffset_ - clip) / depthScale_ : depthOffset_ / (clip + depthScale_);
  return static_cast<float>(depth);
}

void depthsOf(const ViewMatrices& matrices, std::span<const float> window, const glm::ivec2& windowSize,
              const glm::ivec2& size, std::span<float> depths) {
  assert(window.size() == static_cast<std::size_t>(windowSize.x) * static_cast<std::size_t>(windowSize.y));
  assert(depths.size() == static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y));
  constexpr std::size_t minimum = 1U << 15;  // pixels
  vdi::inParallel(depths.size(), minimum, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const auto width = static_cast<std::size_t>(size.x);
      const std::size_t row = i / width;
      const glm::dvec2 centre = glm::dvec2(i % width, row) + 0.5;
      const glm::ivec2 at =
          glm::min(glm::ivec2(centre * glm::dvec2(windowSize) / glm::dvec2(size)), windowSize - 1);
      depths[i] =
          matrices.depthOf(window[static_cast<std::size_t>(at.y) * static_cast<std::size_t>(windowSize.x) +
                                  static_cast<std::size_t>(at.x)]);
    }
  });
}

}  // namespace pv
