// Where in the world what the filter has made is: the box of its scene, and the rectangle of its flat
// picture. They are in the image's field data (VDIImageData.h), of VDIs and of pictures without one.
#ifndef VDIPlace_h
#define VDIPlace_h

#include <array>
#include <glm/glm.hpp>
#include <optional>

#include "vdi/core/Box.h"
#include "vdi/core/Camera.h"

class vtkFieldData;

namespace pv {

/// VDI.camera and VDI.bounds.
void setPlace(vtkFieldData* fields, const vdi::Camera& camera, const vdi::Box& bounds);

/// Nullopt where there is no scene, or an empty one.
std::optional<vdi::Box> boxIn(vtkFieldData* fields);

/// Nullopt where there is no camera.
std::optional<vdi::Camera> cameraIn(vtkFieldData* fields);

/// The world positions of a picture's corners: lower left, lower right, upper right, upper left. The picture
/// stands at the depth of the scene's middle: halfway between the nearest and the farthest corner of `bounds`
/// in front of the camera. From that camera it covers what it shows. A scene behind the camera puts it at the
/// focal point.
std::array<glm::dvec3, 4> cornersOf(const vdi::View& view, const vdi::Box& bounds);

}  // namespace pv

#endif
