// Views that look from where a VDI of a file was made.
#ifndef VDIViewpoint_h
#define VDIViewpoint_h

#include <array>
#include <optional>

class pqPipelineSource;
class vtkSMProxy;
class vtkSMRenderViewProxy;

namespace pv {

/// Position, focal point, view-up, view angle in degrees, whether the projection is parallel, parallel scale.
using ViewpointNumbers = std::array<double, 12>;

/// Of a reader; asks the server. None: no VDI could be read.
std::optional<ViewpointNumbers> viewpointOf(vtkSMProxy* reader);

/// Moves the view's camera there.
void lookFrom(const ViewpointNumbers& viewpoint, vtkSMRenderViewProxy* view);

/// Moves the active view's camera to where the VDI of a reader was made, if it shows that and nothing else,
/// and renders it.
void lookFromViewpointOf(pqPipelineSource* source);

}  // namespace pv

#endif
