// Translation of a volume's display properties in ParaView, and of a view's lights, to properties of
// VolumetricDepthImage.
#ifndef VDIVolumeDisplay_h
#define VDIVolumeDisplay_h

#include <string>

namespace vdi {
struct Box;
}
class vtkPVDataInformation;
class vtkSMProxy;
class vtkSMRenderViewProxy;

namespace pv {

/// Sets Lights of `filter`, and Shade, Diffuse and Ambient if `shown` shows a shaded volume; null means that
/// it isn't shown. Volumes reflect ambient light only under a single headlight. This function and the next
/// ones with `shown` leave what a user has set: the lights, the shading, the cropping, or the blending.
void takeShading(vtkSMProxy* filter, vtkSMProxy* shown, vtkSMRenderViewProxy* view);

/// Sets Lights of `filter` to the view's, or clears Lights if the view has the default ones, even if a
/// user has set others.
void takeLights(vtkSMProxy* filter, vtkSMRenderViewProxy* view);

/// The box to which the scale and the origin of a cropped volume of these data apply. Null means that there
/// are no data, and gives an empty box.
vdi::Box wholeToCrop(vtkPVDataInformation* data);

/// Sets Cropping and CroppingBox if `shown` shows a cropped volume: to the box that ParaView draws. `whole`
/// is that of wholeToCrop, over all ranks.
void takeCropping(vtkSMProxy* filter, vtkSMProxy* shown, const vdi::Box& whole);

/// Sets BlendMode and IsosurfaceValues of `filter` if `shown` shows a volume in a blend mode that the filter
/// has.
void takeBlending(vtkSMProxy* filter, vtkSMProxy* shown);

/// Sets InterpolationType of `filter` to that of the volume that `shown` shows.
void takeInterpolation(vtkSMProxy* filter, vtkSMProxy* shown);

/// Whether `shown` shows a volume whose components are colour and opacity together, without Map Scalars or
/// with Multi Components Mapping.
bool takesComponentsTogether(vtkSMProxy* shown);

/// The message for a user whose view shows the volume by properties that the filter lacks: its blend mode,
/// another array's opacity, a 2-D transfer function, another place. Empty if the filter shows what the view
/// shows. `isTogether`: the filter takes components together.
std::string displayIssues(vtkSMProxy* shown, bool isTogether);

}  // namespace pv

#endif
