// The views that show a source, or what other filters make of it.
#ifndef VDIViews_h
#define VDIViews_h

class pqPipelineSource;
class pqView;

namespace pv {

/// Whether the source is visible in the view.
bool shows(pqView* view, pqPipelineSource* source);

/// The same for the source and for all that filters such as Render VDI make of it.
bool showsResultOf(pqView* view, pqPipelineSource* source);

/// Renders the views that show the source, and all others that are out of date, such as those of Render VDI.
void renderViewsOf(pqPipelineSource* source);

}  // namespace pv

#endif
