#include "VDIViews.h"

#include <pqApplicationCore.h>
#include <pqDataRepresentation.h>
#include <pqOutputPort.h>
#include <pqPipelineSource.h>
#include <pqServerManagerModel.h>
#include <pqView.h>
#include <vtkPVRenderView.h>
#include <vtkPropCollection.h>
#include <vtkRenderer.h>
#include <vtkSMViewProxy.h>
#include <QList>

#include <algorithm>

#include "vtkVDIProp.h"

namespace pv {

bool shows(pqView* view, pqPipelineSource* source) {
  const QList<pqOutputPort*> ports = source->getOutputPorts();
  return std::any_of(ports.begin(), ports.end(), [view](pqOutputPort* port) {
    pqDataRepresentation* shown = port->getRepresentation(view);
    return shown != nullptr && shown->isVisible();
  });
}

bool showsResultOf(pqView* view, pqPipelineSource* source) {
  if (shows(view, source)) return true;
  const QList<pqPipelineSource*> consumers = source->getAllConsumers();
  return std::any_of(consumers.begin(), consumers.end(),
                     [view](pqPipelineSource* consumer) { return showsResultOf(view, consumer); });
}

void renderViewsOf(pqPipelineSource* source) {
  source->renderAllViews();
  // ParaView takes the views of the source alone.
  for (pqView* view : pqApplicationCore::instance()->getServerManagerModel()->findItems<pqView*>()) {
    if (view->getViewProxy()->GetNeedsUpdate()) view->render();
  }
}

vtkPVRenderView* renderViewOf(pqView* view) {
  return vtkPVRenderView::SafeDownCast(view->getViewProxy()->GetClientSideView());
}

std::vector<vtkVDIProp*> vdisOf(pqView* view) {
  std::vector<vtkVDIProp*> vdis;
  vtkPVRenderView* drawn = renderViewOf(view);
  if (drawn == nullptr) return vdis;
  vtkPropCollection* props = drawn->GetRenderer()->GetViewProps();
  vtkCollectionSimpleIterator at;
  props->InitTraversal(at);
  while (vtkProp* prop = props->GetNextProp(at)) {
    if (auto* vdi = vtkVDIProp::SafeDownCast(prop)) vdis.push_back(vdi);
  }
  return vdis;
}

bool isBehind(pqView* view) {
  const std::vector<vtkVDIProp*> vdis = vdisOf(view);
  return std::any_of(vdis.begin(), vdis.end(), [](const vtkVDIProp* vdi) { return vdi->IsBehind(); });
}

}  // namespace pv
