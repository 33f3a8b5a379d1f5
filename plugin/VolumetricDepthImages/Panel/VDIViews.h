// The views that show a source, or the results of other filters on it.
#ifndef VDIViews_h
#define VDIViews_h

#include <vector>

class pqPipelineSource;
class pqView;
class vtkPVRenderView;
class vtkVDIProp;

namespace pv {

/// Whether the source is visible in the view.
bool shows(pqView* view, pqPipelineSource* source);

/// Whether the view shows the source, or anything that filters such as Render VDI make of it.
bool showsResultOf(pqView* view, pqPipelineSource* source);

/// Renders the views that show the source, and all others that are out of date, such as those of Render VDI.
void renderViewsOf(pqPipelineSource* source);

/// The view's client side; null if it is no render view.
vtkPVRenderView* renderViewOf(pqView* view);

/// The VDIs that the view's last frame showed or was to show.
std::vector<vtkVDIProp*> vdisOf(pqView* view);

/// Whether the view's last frame lacks something of a VDI that is being made or loaded.
bool isBehind(pqView* view);

}  // namespace pv

#endif
