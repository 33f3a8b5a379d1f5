// Cameras and sizes of ParaView's views.
#ifndef VDICameras_h
#define VDICameras_h

#include <array>

class vtkCamera;
class vtkSMRenderViewProxy;
class vtkSMViewProxy;
namespace vdi {
struct Camera;
}

namespace pv {

vdi::Camera cameraOf(vtkCamera* camera);
/// Whether a user has placed the view's camera: it isn't where new views have it.
bool isPlaced(vtkSMRenderViewProxy* view);
/// The view's size, reduced to at most as many pixels as 1920 x 1080 has, because a VDI's time and size grow
/// with them.
std::array<int, 2> resolutionOf(vtkSMViewProxy* view);

}  // namespace pv

#endif
