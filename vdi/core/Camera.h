// Camera and the rays it casts. Spaces and conventions, the same in C++, GLSL and VTK:
//   * world space: the coordinates of the data set, any unit, double precision;
//   * view space: x right, y up, z = *depth* along the view axis, positive in front, in world units;
//   * pixels: column x from the left, row y from the *bottom* (as vtkImageData and OpenGL), centres at +0.5.
// A ray is p(depth) = origin + depth * direction, where direction has unit view-space z. The world length of
// a depth interval is therefore depth interval * |direction|.
#pragma once

#include <glm/glm.hpp>

#include "vdi/core/Box.h"

namespace vdi {

/// The parameters of vtkCamera that shape a picture; vtkCamera.h explains each of them.
struct Camera {
  glm::dvec3 position{0.0, 0.0, 1.0};
  glm::dvec3 focalPoint{0.0, 0.0, 0.0};
  glm::dvec3 viewUp{0.0, 1.0, 0.0};
  double viewAngle = 30.0;  // vertical, degrees, in (0, 180); perspective only
  bool parallelProjection = false;
  double parallelScale = 1.0;  // half the height of the viewport in world units, > 0; parallel only

  bool operator==(const Camera&) const = default;

  /// The camera turned by `degrees` about the focal point, around view-up as set, of any length; positive
  /// moves the camera to its own right. View-up stays. As vtkCamera::Azimuth does, this keeps the distance
  /// along view-up, and a camera that looks along view-up stays in place. Like vtkCamera, it replaces a
  /// view-up of zero by (0, 1, 0).
  Camera azimuth(double degrees) const;

  /// A camera looking along `direction` at the whole of `bounds`, as vtkRenderer::ResetCamera places it.
  static Camera framing(const Box& bounds, const glm::dvec3& direction, const glm::dvec3& viewUp,
                        double viewAngle = 30.0);
};

struct Ray {
  glm::dvec3 origin;     // world; its depth is 0
  glm::dvec3 direction;  // world per unit of depth
};

/// The part of the image plane that a picture shows: view-space x and y of its lower left and upper right
/// corner, at depth 1 (perspective) or any depth (parallel).
struct ImagePlane {
  glm::dvec2 low{-1.0};
  glm::dvec2 high{1.0};

  bool operator==(const ImagePlane&) const = default;
};

/// A camera with a viewport of width x height pixels: the orthonormal view basis and the mapping between
/// pixels and rays.
class View {
 public:
  static constexpr int maxSide = 32768;  // largest side of a viewport, in pixels
  /// Square pixels; the vertical extent is the camera's, as in VTK. A view-up parallel to the view direction
  /// is replaced by the axis most orthogonal to it, a view-up of zero by (0, 1, 0). Throws
  /// Error{InvalidArgument} for a viewport outside 1 .. maxSide, a view angle outside (0, 180), a parallel
  /// scale <= 0, values that are not finite, or a position equal to the focal point.
  View(const Camera& camera, int width, int height);
  /// A picture of any part of the camera's image plane, off-centre and with oblong pixels if need be, as
  /// tiles and stereo require. It ignores the camera's view angle and parallel scale. Throws as the first
  /// constructor, and Error{InvalidArgument} for a plane that is not finite or has no extent.
  View(const Camera& camera, int width, int height, const ImagePlane& plane);
  /// The first constructor's picture of width x height pixels, with margin.x more pixels of the same size on
  /// its left and right, and margin.y below and above. Throws as the first constructor, for the whole
  /// picture.
  static View withMargin(const Camera& camera, int width, int height, const glm::ivec2& margin);

  const Camera& camera() const { return camera_; }
  int width() const { return width_; }
  int height() const { return height_; }
  bool parallel() const { return camera_.parallelProjection; }

  const glm::dvec3& right() const { return right_; }      // world, unit
  const glm::dvec3& up() const { return up_; }            // world, unit
  const glm::dvec3& forward() const { return forward_; }  // world, unit: the axis of depth

  /// Half the height of the image plane, at depth 1 (perspective) or any depth (parallel), in world units.
  double halfHeight() const { return halfHeight_; }
  double halfWidth() const { return halfWidth_; }
  /// View-space x and y of the image plane's middle, at the same depth: 0 unless a plane was set.
  const glm::dvec2& middle() const { return middle_; }

  double depthOf(const glm::dvec3& world) const { return glm::dot(world - camera_.position, forward_); }
  glm::dvec3 toView(const glm::dvec3& world) const;

  /// The ray through pixel coordinates (x, y); the centre of pixel (i, j) is (i + 0.5, j + 0.5).
  Ray rayThrough(double x, double y) const;

 private:
  Camera camera_;
  int width_;
  int height_;
  glm::dvec3 right_;
  glm::dvec3 up_;
  glm::dvec3 forward_;
  double halfHeight_;
  double halfWidth_;
  glm::dvec2 middle_{0.0};  // middle of the image plane, in the units of ImagePlane
  glm::dvec2 pixelSize_;
};

}  // namespace vdi
