// The place of the filter's output in the world: the box of its scene, and the rectangle of its flat picture.
// The image's field data hold both (VDIImageData.h), for VDIs and for pictures without one.
#ifndef VDIPlace_h
#define VDIPlace_h

#include <array>
#include <glm/glm.hpp>
#include <optional>

#include "vdi/core/Box.h"
#include "vdi/core/Camera.h"

class vtkFieldData;

namespace pv {

/// Sets VDI.camera and VDI.bounds.
void setPlace(vtkFieldData* fields, const vdi::Camera& camera, const vdi::Box& bounds);

/// The scene's box; nullopt if there is no scene, or an empty one.
std::optional<vdi::Box> boxIn(vtkFieldData* fields);

/// The camera; nullopt if there is none.
std::optional<vdi::Camera> cameraIn(vtkFieldData* fields);

/// The world positions of a picture's corners: lower left, lower right, upper right, upper left. The picture
/// stands at the depth of the scene's middle: halfway between the nearest and the farthest corner of `bounds`
/// in front of the camera. Seen from that camera, it covers exactly the view. If the scene lies behind the
/// camera, the picture stands at the focal point.
std::array<glm::dvec3, 4> cornersOf(const vdi::View& view, const vdi::Box& bounds);

}  // namespace pv

#endif
