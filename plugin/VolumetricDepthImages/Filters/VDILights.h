// Shading as ParaView shows it: what a view's lights and a volume's display properties say.
#ifndef VDILights_h
#define VDILights_h

class vtkSMProxy;
class vtkSMRenderViewProxy;

namespace pv {

/// Sets Shade, Diffuse and Ambient of `filter`, a VolumetricDepthImage, where `shown` is shown as a shaded
/// volume; null: it isn't shown. Volumes reflect ambient light only where a single headlight shines.
void takeShading(vtkSMProxy* filter, vtkSMProxy* shown, vtkSMRenderViewProxy* view);

/// Sets Lights of `filter` to the view's, unless these are the default ones and nothing is set.
void takeLights(vtkSMProxy* filter, vtkSMRenderViewProxy* view);

}  // namespace pv

#endif
