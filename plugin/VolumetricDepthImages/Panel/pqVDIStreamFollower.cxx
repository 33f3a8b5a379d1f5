#include "pqVDIStreamFollower.h"

#include <pqApplicationCore.h>
#include <pqPipelineSource.h>
#include <pqServer.h>
#include <pqServerManagerModel.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMSourceProxy.h>
#include <QApplication>

#include "VDIServer.h"
#include "VDIServers.h"
#include "VDIViewpoint.h"
#include "VDIViews.h"

namespace {

constexpr int lookLocallyMilliseconds = 100;
constexpr int lookRemotelyMilliseconds = 250;

}  // namespace

pqVDIStreamFollower::pqVDIStreamFollower(pqPipelineSource* source) : QObject(source), Source(source) {
  this->Looking.setInterval(source->getServer()->isRemote() ? lookRemotelyMilliseconds
                                                            : lookLocallyMilliseconds);
  this->connect(&this->Looking, &QTimer::timeout, this, &pqVDIStreamFollower::look);
  this->Looking.start();
}

pqVDIStreamFollower::~pqVDIStreamFollower() = default;

pqVDIStreamFollower* pqVDIStreamFollower::of(vtkSMProxy* proxy) {
  auto* source = pqApplicationCore::instance()->getServerManagerModel()->findItem<pqPipelineSource*>(proxy);
  return source != nullptr ? source->findChild<pqVDIStreamFollower*>() : nullptr;
}

void pqVDIStreamFollower::lookFromViewpoint() {
  this->WaitsForFirst = !pv::viewpointOf(this->Source->getProxy());
  if (!this->WaitsForFirst) pv::lookFromViewpointOf(this->Source);
}

void pqVDIStreamFollower::look() {
  // Neither interrupts a user who turns the view nor waits for a busy server.
  if (this->Source->modifiedState() == pqProxy::UNINITIALIZED ||
      QApplication::mouseButtons() != Qt::NoButton || !pv::mayAsk(this->Source->getServer()))
    return;
  auto* proxy = vtkSMSourceProxy::SafeDownCast(this->Source->getProxy());
  const int arrivals = vtkSMPropertyHelper(pv::asked(proxy, "Arrivals")).GetAsInt();
  if (arrivals != this->Seen) {
    this->Seen = arrivals;
    pv::command(proxy, "Take");
    proxy->MarkDirty(proxy);
    pv::renderViewsOf(this->Source);
    if (this->WaitsForFirst) this->lookFromViewpoint();
  }
  const QString line = vtkSMPropertyHelper(pv::asked(proxy, "Connection")).GetAsString();
  if (line == this->Line) return;
  this->Line = line;
  Q_EMIT this->lineChanged();
}
