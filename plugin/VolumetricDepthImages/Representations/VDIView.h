// VTK's camera, bounds and depth buffer in the form that a renderer of VDIs takes.
#ifndef VDIView_h
#define VDIView_h

#include <glm/glm.hpp>
#include <span>

#include "vdi/core/Box.h"
#include "vdi/core/Camera.h"

class vtkMatrix4x4;
class vtkRenderer;

namespace pv {

/// The box of bounds as VTK has them: low and high end of x, y and z.
vdi::Box boxOf(const double* bounds);

/// A renderer's part of its window, in pixels.
struct Viewport {
  glm::ivec2 size{0};
  glm::ivec2 corner{0};
};
Viewport viewportOf(vtkRenderer* renderer);

/// Values of a depth buffer from here on belong to the background.
constexpr float backgroundDepth = 1.0F - 8.0F / 16777216.0F;

constexpr bool isObject(float window) {
  return window < backgroundDepth;
}

/// A view as OpenGL has it. The two matrices know of tiles, stereo and explicit projections.
class ViewMatrices {
 public:
  ViewMatrices() = default;
  /// The view of the renderer's active camera.
  explicit ViewMatrices(vtkRenderer* renderer);
  /// Takes the transposed matrices of vtkOpenGLCamera::GetKeyMatrices: world to view, view to clip
  /// coordinates.
  ViewMatrices(vtkMatrix4x4* worldToView, vtkMatrix4x4* viewToClip);

  /// Throws as vdi::View does.
  vdi::View view(int width, int height) const;
  /// The view of `count` rows, from row `first` on, of a picture of this size.
  vdi::View rows(const glm::ivec2& size, int first, int count) const;
  /// The depth along the view axis for a value of the depth buffer in [0, 1]; infinity for the background.
  float depthOf(float window) const;

  bool operator==(const ViewMatrices&) const = default;

 private:
  vdi::Camera camera_;
  vdi::ImagePlane plane_;
  double depthScale_ = 1.0;   // in clip coordinates
  double depthOffset_ = 0.0;  // in clip coordinates
};

/// Depths of a smaller picture's pixels, at their centres.
void depthsOf(const ViewMatrices& matrices, std::span<const float> window, const glm::ivec2& windowSize,
              const glm::ivec2& size, std::span<float> depths);

}  // namespace pv

#endif
