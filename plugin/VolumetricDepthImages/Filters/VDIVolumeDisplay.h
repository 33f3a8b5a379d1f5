// What ParaView's display properties of a volume, and the lights of a view, mean for VolumetricDepthImage.
#ifndef VDIVolumeDisplay_h
#define VDIVolumeDisplay_h

#include <string>

namespace vdi {
struct Box;
}
class vtkSMProxy;
class vtkSMRenderViewProxy;

namespace pv {

/// Sets Shade, Diffuse and Ambient of `filter`, a VolumetricDepthImage, where `shown` is shown as a shaded
/// volume; null: it isn't shown. Volumes reflect ambient light only where a single headlight shines.
void takeShading(vtkSMProxy* filter, vtkSMProxy* shown, vtkSMRenderViewProxy* view);

/// Sets Lights of `filter` to the view's, unless these are the default ones and nothing is set.
void takeLights(vtkSMProxy* filter, vtkSMRenderViewProxy* view);

/// Sets Cropping and CroppingBox where `shown` is shown as a cropped volume of those bounds.
void takeCropping(vtkSMProxy* filter, vtkSMProxy* shown, const vdi::Box& bounds);

/// What to tell a user whose volume is shown in a way that no VDI can hold; empty where it isn't.
std::string blendModeIssue(vtkSMProxy* shown);

}  // namespace pv

#endif
