// The views that show a source, or the results of other filters on it.
#ifndef VDIViews_h
#define VDIViews_h

class pqPipelineSource;
class pqView;

namespace pv {

/// Whether the source is visible in the view.
bool shows(pqView* view, pqPipelineSource* source);

/// Whether the view shows the source, or anything that filters such as Render VDI make of it.
bool showsResultOf(pqView* view, pqPipelineSource* source);

/// Renders the views that show the source, and all others that are out of date, such as those of Render VDI.
void renderViewsOf(pqPipelineSource* source);

}  // namespace pv

#endif
