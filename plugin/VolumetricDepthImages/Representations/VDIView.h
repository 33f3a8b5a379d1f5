// What VTK's camera and depth buffer mean to a renderer of VDIs.
#ifndef VDIView_h
#define VDIView_h

#include <glm/glm.hpp>
#include <span>

#include "vdi/core/Camera.h"

class vtkMatrix4x4;

namespace pv {

/// Of depth buffers: what's there, and beyond, is background.
constexpr float backgroundDepth = 1.0F - 8.0F / 16777216.0F;

constexpr bool isObject(float window) {
  return window < backgroundDepth;
}

/// A view of OpenGL's: from its two matrices, so that tiles, stereo and explicit projections are right.
class ViewMatrices {
 public:
  ViewMatrices() = default;
  /// As vtkOpenGLCamera::GetKeyMatrices gives them, transposed: world to view, view to clip coordinates.
  ViewMatrices(vtkMatrix4x4* worldToView, vtkMatrix4x4* viewToClip);

  /// Throws as vdi::View does.
  vdi::View view(int width, int height) const;
  /// Of a picture of that size, `count` rows from row `first` on.
  vdi::View rows(const glm::ivec2& size, int first, int count) const;
  /// Depth along the view axis of a value of the depth buffer, in [0, 1]; infinity for the background.
  float depthOf(float window) const;

  bool operator==(const ViewMatrices&) const = default;

 private:
  vdi::Camera camera_;
  vdi::ImagePlane plane_;
  double depthScale_ = 1.0;   // of clip coordinates
  double depthOffset_ = 0.0;  // of clip coordinates
};

/// The depths of a smaller picture's pixels: those at their centres.
void depthsOf(const ViewMatrices& matrices, std::span<const float> window, const glm::ivec2& windowSize,
              const glm::ivec2& size, std::span<float> depths);

}  // namespace pv

#endif
