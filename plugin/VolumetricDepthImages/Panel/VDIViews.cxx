#include "VDIViews.h"

#include <pqApplicationCore.h>
#include <pqDataRepresentation.h>
#include <pqOutputPort.h>
#include <pqPipelineSource.h>
#include <pqServerManagerModel.h>
#include <pqView.h>
#include <vtkSMViewProxy.h>
#include <QList>

#include <algorithm>

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

}  // namespace pv
