// Moves views to the viewpoint at which a file's VDI was made.
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

/// The viewpoint of a reader's VDI; nullopt if no VDI could be read. Asks the server.
std::optional<ViewpointNumbers> viewpointOf(vtkSMProxy* reader);

/// Moves the view's camera to the viewpoint.
void lookFrom(const ViewpointNumbers& viewpoint, vtkSMRenderViewProxy* view);

/// Moves the active view's camera to the viewpoint of a reader's VDI, if the view shows that and nothing
/// else, and renders the view.
void lookFromViewpointOf(pqPipelineSource* source);

}  // namespace pv

#endif
