#include "pqVDIStillFrames.h"

#include <pqApplicationCore.h>
#include <pqServerManagerModel.h>
#include <pqView.h>
#include <vtkPVRenderView.h>
#include <QApplication>
#include <QEvent>

#include <algorithm>
#include <vector>

#include "VDIServers.h"
#include "VDIViews.h"
#include "vtkVDIProp.h"
#include "vtkVDIRepresentation.h"

namespace {

constexpr int watchMilliseconds = 30;

bool hasMore(pqView* view) {
  const std::vector<vtkVDIProp*> vdis = pv::vdisOf(view);
  return std::any_of(vdis.begin(), vdis.end(), [](const vtkVDIProp* vdi) { return vdi->HasMore(); });
}

}  // namespace

pqVDIStillFrames::pqVDIStillFrames(QObject* parent) : QObject(parent) {
  this->Looking.setInterval(watchMilliseconds);
  this->connect(&this->Looking, &QTimer::timeout, this, &pqVDIStillFrames::look);
  pqServerManagerModel* model = pqApplicationCore::instance()->getServerManagerModel();
  this->connect(model, &pqServerManagerModel::viewAdded, this, &pqVDIStillFrames::viewAdded);
  for (pqView* view : model->findItems<pqView*>()) this->viewAdded(view);
  QApplication::instance()->installEventFilter(this);
}

/// Pauses full pictures at a click or a key. With few cores, they would take the processor from the window.
bool pqVDIStillFrames::eventFilter(QObject* watched, QEvent* event) {
  switch (event->type()) {
    case QEvent::MouseButtonPress:
    case QEvent::MouseButtonRelease:
    case QEvent::KeyPress:
      for (const QPointer<pqView>& view : this->Behind) {
        if (view == nullptr) continue;
        for (vtkVDIProp* vdi : pv::vdisOf(view)) vdi->Rest();
      }
      break;
    default:
      break;
  }
  return QObject::eventFilter(watched, event);
}

pqVDIStillFrames::~pqVDIStillFrames() {
  vtkVDIRepresentation::DeferNoStillFrames();
}

void pqVDIStillFrames::viewAdded(pqView* view) {
  this->connect(view, &pqView::beginRender, this, &pqVDIStillFrames::begins);
  this->connect(view, &pqView::endRender, this, &pqVDIStillFrames::rendered);
}

void pqVDIStillFrames::begins() {
  auto* view = qobject_cast<pqView*>(this->sender());
  vtkPVRenderView* drawn = view != nullptr ? pv::renderViewOf(view) : nullptr;
  if (drawn != nullptr) vtkVDIRepresentation::DeferStillFrames(drawn);
}

void pqVDIStillFrames::rendered() {
  auto* view = qobject_cast<pqView*>(this->sender());
  if (view == nullptr) return;
  this->Behind.removeAll(view);
  if (!pv::isBehind(view)) return;
  this->Behind.append(view);
  this->Looking.start();
}

void pqVDIStillFrames::look() {
  const QList<QPointer<pqView>> views = this->Behind;
  for (const QPointer<pqView>& view : views) {
    if (view != nullptr && !pv::mayAsk(view->getServer())) continue;
    if (view != nullptr && pv::isBehind(view)) {
      if (hasMore(view)) view->forceRender();
    } else {
      this->Behind.removeAll(view);
    }
  }
  if (this->Behind.isEmpty()) this->Looking.stop();
}
