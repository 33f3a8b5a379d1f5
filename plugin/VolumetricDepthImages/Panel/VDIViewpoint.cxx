#include "VDIViewpoint.h"

#include <pqActiveObjects.h>
#include <pqDataRepresentation.h>
#include <pqPipelineSource.h>
#include <pqUndoStack.h>
#include <pqView.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMProxy.h>
#include <vtkSMRenderViewProxy.h>

#include <algorithm>

#include "VDIServer.h"

namespace pv {

namespace {

/// Whether the view shows the source, and nothing else.
bool showsOnly(pqView* view, pqPipelineSource* source) {
  bool shown = false;
  for (pqRepresentation* each : view->getRepresentations()) {
    auto* data = qobject_cast<pqDataRepresentation*>(each);
    if (data == nullptr || !data->isVisible()) continue;
    if (data->getInput() != source) return false;
    shown = true;
  }
  return shown;
}

}  // namespace

std::optional<ViewpointNumbers> viewpointOf(vtkSMProxy* reader) {
  ViewpointNumbers numbers{};
  vtkSMPropertyHelper(asked(reader, "Viewpoint"))
      .Get(numbers.data(), static_cast<unsigned int>(numbers.size()));
  if (std::equal(numbers.begin(), numbers.begin() + 3, numbers.begin() + 3)) return std::nullopt;
  return numbers;
}

void lookFrom(const ViewpointNumbers& viewpoint, vtkSMRenderViewProxy* view) {
  vtkSMPropertyHelper(view, "CameraPosition").Set(viewpoint.data(), 3);
  vtkSMPropertyHelper(view, "CameraFocalPoint").Set(&viewpoint[3], 3);
  vtkSMPropertyHelper(view, "CameraViewUp").Set(&viewpoint[6], 3);
  vtkSMPropertyHelper(view, "CameraViewAngle").Set(viewpoint[9]);
  vtkSMPropertyHelper(view, "CameraParallelProjection").Set(viewpoint[10] != 0.0 ? 1 : 0);
  vtkSMPropertyHelper(view, "CameraParallelScale").Set(viewpoint[11]);
  view->UpdateVTKObjects();
}

/// A VDI is most accurate from its viewpoint, and may be visible only from there. ParaView's default camera
/// looks along z.
void lookFromViewpointOf(pqPipelineSource* source) {
  pqView* view = pqActiveObjects::instance().activeView();
  auto* proxy = view != nullptr ? vtkSMRenderViewProxy::SafeDownCast(view->getViewProxy()) : nullptr;
  if (proxy == nullptr || !showsOnly(view, source)) return;
  const auto viewpoint = viewpointOf(source->getProxy());
  if (!viewpoint) return;
  BEGIN_UNDO_EXCLUDE();
  lookFrom(*viewpoint, proxy);
  END_UNDO_EXCLUDE();
  view->render();
}

}  // namespace pv
