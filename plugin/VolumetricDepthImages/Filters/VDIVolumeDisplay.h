// What ParaView's display properties of a volume, and the lights of a view, mean for VolumetricDepthImage.
#ifndef VDIVolumeDisplay_h
#define VDIVolumeDisplay_h

#include <string>

class vtkPVDataInformation;
class vtkSMProxy;
class vtkSMRenderViewProxy;

namespace pv {

/// Sets Shade, Diffuse and Ambient of `filter`, a VolumetricDepthImage, where `shown` is shown as a shaded
/// volume; null: it isn't shown. Volumes reflect ambient light only where a single headlight shines.
void takeShading(vtkSMProxy* filter, vtkSMProxy* shown, vtkSMRenderViewProxy* view);

/// Sets Lights of `filter` to the view's, unless these are the default ones and nothing is set.
void takeLights(vtkSMProxy* filter, vtkSMRenderViewProxy* view);

/// Sets Cropping and CroppingBox where `shown` is shown as a cropped volume: the box that ParaView draws.
/// `data`: what is shown; null: nothing.
void takeCropping(vtkSMProxy* filter, vtkSMProxy* shown, vtkPVDataInformation* data);

/// Sets BlendMode and IsosurfaceValues of `filter` where `shown` is shown as a volume in a blend mode that it
/// has.
void takeBlending(vtkSMProxy* filter, vtkSMProxy* shown);

/// What to tell a user whose volume is shown in a blend mode that the filter doesn't have; empty where it has
/// it.
std::string blendModeIssue(vtkSMProxy* shown);

}  // namespace pv

#endif
