#include "pqVDIRegenerator.h"

#include <pqActiveObjects.h>
#include <pqAnimationScene.h>
#include <pqApplicationCore.h>
#include <pqCoreUtilities.h>
#include <pqDataRepresentation.h>
#include <pqOutputPort.h>
#include <pqPipelineSource.h>
#include <pqServer.h>
#include <pqServerManagerModel.h>
#include <pqUndoStack.h>
#include <pqView.h>
#include <vtkCamera.h>
#include <vtkCommand.h>
#include <vtkOutputWindow.h>
#include <vtkSMComparativeViewProxy.h>
#include <vtkSMProperty.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMRenderViewProxy.h>
#include <vtkWeakPointer.h>
#include <QApplication>
#include <QEvent>
#include <QWidget>

#include <algorithm>
#include <string>

#include "VDIServer.h"
#include "VDIServers.h"
#include "VDIViews.h"
#include "vtkSMVDIGeneratorProxy.h"
#include "vtkSMVDIRepresentationProxy.h"
#include "vtkVDIGenerator.h"
#include "vtkVDIProp.h"
#include "vtkVDIRepresentation.h"

namespace {

constexpr int lookMilliseconds = 40;
constexpr int lookAtViewsMilliseconds = 250;
/// The time that an edit rests before the VDI is regenerated.
constexpr int editRestMilliseconds = 400;
constexpr int showMilliseconds = 100;
constexpr int mostRestarts = 5;

std::array<double, 10> numbersOf(vtkCamera* camera) {
  std::array<double, 10> numbers{};
  camera->GetPosition(numbers.data());
  camera->GetFocalPoint(&numbers[3]);
  camera->GetViewUp(&numbers[6]);
  numbers[9] = camera->GetParallelScale();
  return numbers;
}

}  // namespace

struct pqVDIRegenerator::Watched {
  vtkWeakPointer<vtkObject> Map;
  unsigned long Observer = 0;
};

pqVDIRegenerator::pqVDIRegenerator(pqPipelineSource* source) : QObject(source), Source(source) {
  this->Looking.setInterval(lookMilliseconds);
  this->connect(&this->Looking, &QTimer::timeout, this, &pqVDIRegenerator::look);
  this->LookingAtViews.setInterval(lookAtViewsMilliseconds);
  this->connect(&this->LookingAtViews, &QTimer::timeout, this, &pqVDIRegenerator::lookAtViews);
  this->LookingAtViews.start();
  this->Showing.setInterval(showMilliseconds);
  this->connect(&this->Showing, &QTimer::timeout, this, &pqVDIRegenerator::lookWhatIsShown);
  QApplication::instance()->installEventFilter(this);
  for (const char* name : {"LookupTable", "ScalarOpacityFunction"}) {
    pqCoreUtilities::connect(source->getProxy()->GetProperty(name), vtkCommand::ModifiedEvent, this,
                             SLOT(watchMaps()));
  }
  this->watchMaps();
  for (const char* name : {"Auto", "AutoAngle"}) {
    pqCoreUtilities::connect(source->getProxy()->GetProperty(name), vtkCommand::ModifiedEvent, this,
                             SLOT(autoChanged()));
  }
  pqCoreUtilities::connect(source->getProxy()->GetProperty("Cropping"),
                           vtkCommand::UncheckedPropertyModifiedEvent, this, SLOT(croppingChanged()));
  if (pqUndoStack* undo = pqApplicationCore::instance()->getUndoStack()) {
    this->connect(undo, &pqUndoStack::undone, this, &pqVDIRegenerator::leaveToUser);
    this->connect(undo, &pqUndoStack::redone, this, &pqVDIRegenerator::leaveToUser);
  }
  this->connect(source, &pqProxy::modifiedStateChanged, this, &pqVDIRegenerator::stateChanged);
  pqServerManagerModel* model = pqApplicationCore::instance()->getServerManagerModel();
  this->connect(model, &pqServerManagerModel::viewAdded, this, &pqVDIRegenerator::viewAdded);
  for (pqView* view : model->findItems<pqView*>()) this->viewAdded(view);
  this->connect(source, &pqPipelineSource::representationRemoved, this,
                &pqVDIRegenerator::lookWhetherViewsWait);
  this->connect(model, &pqServerManagerModel::proxyAdded, this, &pqVDIRegenerator::proxyAdded);
  for (pqAnimationScene* scene : model->findItems<pqAnimationScene*>()) this->proxyAdded(scene);
  // Without a server, the filter is in this process, and the window's timers run while it shows its progress.
  if (auto* filter = vtkVDIGenerator::SafeDownCast(this->generator()->GetClientSideObject()))
    pqCoreUtilities::connect(filter, vtkVDIGenerator::PutOffEvent, this, SLOT(drawSoon()));
  this->lookWhetherViewsWait();
}

pqVDIRegenerator::~pqVDIRegenerator() {
  this->forgetMaps();
}

vtkSMVDIGeneratorProxy* pqVDIRegenerator::generator() const {
  return vtkSMVDIGeneratorProxy::SafeDownCast(this->Source->getProxy());
}

pqVDIRegenerator* pqVDIRegenerator::of(vtkSMVDIGeneratorProxy* proxy) {
  auto* source = pqApplicationCore::instance()->getServerManagerModel()->findItem<pqPipelineSource*>(proxy);
  return source != nullptr ? source->findChild<pqVDIRegenerator*>() : nullptr;
}

void pqVDIRegenerator::forgetMaps() {
  for (const Watched& watched : this->Maps) {
    if (watched.Map != nullptr) watched.Map->RemoveObserver(watched.Observer);
  }
  this->Maps.clear();
}

void pqVDIRegenerator::watchMaps() {
  this->forgetMaps();
  const auto watch = [this](vtkSMProxy* map) {
    if (map == nullptr) return;
    this->Maps.push_back(
        {map, pqCoreUtilities::connect(map, vtkCommand::PropertyModifiedEvent, this, SLOT(mapChanged()))});
  };
  vtkSMProxy* table = vtkSMPropertyHelper(this->generator(), "LookupTable").GetAsProxy();
  watch(table);
  if (table != nullptr) watch(vtkSMPropertyHelper(table, "ScalarOpacityFunction", true).GetAsProxy());
  watch(vtkSMPropertyHelper(this->generator(), "ScalarOpacityFunction").GetAsProxy());
}

/// Whether a view shows the VDI, or the results of other filters on it.
bool pqVDIRegenerator::isUsed() const {
  const QList<pqView*> views = pqApplicationCore::instance()->getServerManagerModel()->findItems<pqView*>();
  return std::any_of(views.begin(), views.end(),
                     [this](pqView* view) { return pv::showsResultOf(view, this->Source); });
}

bool pqVDIRegenerator::isShownIn(pqView* view) const {
  return pv::shows(view, this->Source);
}

/// After an undo of the first Apply, the next Apply is the first one again.
void pqVDIRegenerator::stateChanged() {
  if (this->Source->modifiedState() != pqProxy::UNINITIALIZED) {
    this->generator()->SetUpdatesForView(false);
    return;
  }
  this->generator()->Forget();
  if (this->Now == State::Idle) return;
  this->Looking.stop();
  this->Now = State::Idle;
  pv::command(this->generator(), "Hold");  // gives the running preparation up
  pv::command(this->generator(), "Release");
  this->note({});
}

/// Makes views wait while an animation is playing. Otherwise they would show none of its steps.
void pqVDIRegenerator::proxyAdded(pqProxy* proxy) {
  auto* scene = qobject_cast<pqAnimationScene*>(proxy);
  if (scene == nullptr) return;
  using Signal = void (pqAnimationScene::*)(vtkObject*, unsigned long, void*, void*);
  const auto play = [this](bool plays) {
    this->IsPlaying = plays;
    this->lookWhetherViewsWait();
  };
  this->connect(scene, static_cast<Signal>(&pqAnimationScene::beginPlay), this, [play] { play(true); });
  this->connect(scene, static_cast<Signal>(&pqAnimationScene::endPlay), this, [play] { play(false); });
}

void pqVDIRegenerator::viewAdded(pqView* view) {
  this->connect(view, &pqView::beginRender, this, &pqVDIRegenerator::beginRender);
  this->connect(view, &pqView::endRender, this, &pqVDIRegenerator::endRender);
  this->connect(view, &pqView::updateDataEvent, this, &pqVDIRegenerator::viewUpdated);
  // The source signals a change before the view has it, so this listens to the view.
  this->connect(view, &pqView::representationAdded, this, &pqVDIRegenerator::lookWhetherViewsWait);
  this->connect(view, &pqView::representationRemoved, this, &pqVDIRegenerator::lookWhetherViewsWait);
}

/// Makes screenshots and saved frames of animations wait for the VDI that is being made.
void pqVDIRegenerator::beginRender() {
  auto* view = qobject_cast<pqView*>(this->sender());
  if (view == nullptr || !pv::showsResultOf(view, this->Source)) return;
  vtkRenderWindow* window = view->getViewProxy()->GetRenderWindow();
  if (window == nullptr || !vtkVDIRepresentation::IsCaptured(window)) return;
  this->IsCaptured = true;
  this->lookWhetherViewsWait();
  this->generator()->ReleaseNow();
}

void pqVDIRegenerator::endRender() {
  auto* view = qobject_cast<pqView*>(this->sender());
  this->ToDraw.removeAll(view);
  if (view != nullptr && this->isShownIn(view)) this->Showing.start();
  if (!this->IsCaptured) return;
  this->IsCaptured = false;
  this->lookWhetherViewsWait();
}

/// Lets the legend follow the VDI that the view shows.
void pqVDIRegenerator::followShown(pqView* view) {
  for (pqOutputPort* port : this->Source->getOutputPorts()) {
    const pqDataRepresentation* shown = port->getRepresentation(view);
    auto* proxy = vtkSMVDIRepresentationProxy::SafeDownCast(shown != nullptr ? shown->getProxy() : nullptr);
    if (proxy != nullptr && proxy->FollowShown(view->getProxy())) view->render();
  }
}

/// Comparative views. Each value or time step in one needs a VDI of its own.
QList<pqView*> pqVDIRegenerator::comparativeViews() const {
  QList<pqView*> views = this->Source->getViews();
  views.erase(std::remove_if(views.begin(), views.end(),
                             [](pqView* view) {
                               return vtkSMComparativeViewProxy::SafeDownCast(view->getProxy()) == nullptr;
                             }),
              views.end());
  return views;
}

void pqVDIRegenerator::lookWhetherViewsWait() {
  const bool defers = this->comparativeViews().empty() && !this->IsCaptured && !this->IsPlaying;
  if (defers == this->Defers) return;
  this->Defers = defers;
  this->Restarts = 0;
  this->generator()->SetLegendsWait(defers);
  pv::command(this->generator(), defers ? "DeferViews" : "DeferNoViews");
}

/// Starts a preparation if the view has asked for a VDI that isn't made yet. Stops if several were made in
/// vain.
void pqVDIRegenerator::viewUpdated() {
  if (this->Now != State::Idle || !this->Defers) return;
  auto* view = qobject_cast<pqView*>(this->sender());
  if (view == nullptr || !this->isShownIn(view)) return;
  if (!this->generator()->IsOutdated()) {
    this->Restarts = 0;
  } else if (this->Restarts < mostRestarts) {
    this->drawSoon();
  } else if (this->Restarts == mostRestarts) {
    this->stop();
  }
}

void pqVDIRegenerator::stop() {
  this->Restarts = mostRestarts + 1;  // says so once
  this->Showing.stop();
  const QString why =
      tr("The input changes with each update: %1 VDIs in a row were out of date before they could be shown. "
         "No "
         "more are made until you change something or click into the view. Save Data makes one nevertheless.")
          .arg(mostRestarts);
  this->note(why);
  vtkOutputWindowDisplayWarningText(
      QString("%1: %2\n").arg(this->Source->getSMName(), why).toUtf8().constData());
}

bool pqVDIRegenerator::eventFilter(QObject* watched, QEvent* event) {
  if (event->type() == QEvent::MouseButtonPress || event->type() == QEvent::KeyPress) this->Restarts = 0;
  return QObject::eventFilter(watched, event);
}

void pqVDIRegenerator::note(const QString& text) {
  if (text == this->Note) return;
  this->Note = text;
  Q_EMIT this->noted(text);
}

void pqVDIRegenerator::drawSoon() {
  if (this->Now != State::Idle) return;
  this->Now = State::Waiting;
  this->Rest = 0;
  this->Resting.start();
  this->Looking.start();
}

void pqVDIRegenerator::applies() {
  if (this->Source->modifiedState() == pqProxy::UNINITIALIZED) this->generator()->SetUpdatesForView(true);
}

int pqVDIRegenerator::preparation() {
  pv::command(this->generator(), "ServePreparation");
  return vtkSMPropertyHelper(pv::asked(this->generator(), "Preparation")).GetAsInt();
}

void pqVDIRegenerator::hold(int restMilliseconds) {
  pv::command(this->generator(), "Hold");
  this->Now = State::Waiting;
  this->Rest = restMilliseconds;
  this->Resting.start();
  this->Looking.start();
}

void pqVDIRegenerator::mapChanged() {
  if (this->Source->modifiedState() == pqProxy::UNINITIALIZED || !this->isUsed()) return;
  this->hold(editRestMilliseconds);
}

void pqVDIRegenerator::look() {
  if (!pv::mayAsk(this->Source->getServer())) return;
  if (QApplication::mouseButtons() != Qt::NoButton) {
    this->Resting.start();
    return;
  }
  if (this->Now == State::Waiting) {
    if (this->Resting.elapsed() < this->Rest) return;
    if (!this->comparativeViews().empty()) {
      this->finish();
      return;
    }
    // The preparation of an earlier edit has been given up, but takes a moment to end.
    if (const int earlier = this->preparation(); earlier >= 0 && earlier < 100) return;
    pv::command(this->generator(), "Prepare");
    this->Now = State::Preparing;
    this->Showing.stop();
    this->note(tr("Regenerating the VDI: %1 %").arg(0));
    return;
  }
  const int percent = this->preparation();
  if (percent >= 0 && percent < 100) {
    this->note(tr("Regenerating the VDI: %1 %").arg(percent));
    return;
  }
  this->finish();
}

void pqVDIRegenerator::finish() {
  this->Looking.stop();
  this->Now = State::Idle;
  pv::command(this->generator(), "Release");
  this->generator()->MarkDirty(this->generator());
  // These views have kept the held filter's output.
  for (pqView* view : this->comparativeViews()) view->getProxy()->MarkDirty(this->generator());
  ++this->Restarts;
  this->ToDraw.clear();
  for (pqView* view : this->Source->getViews()) {
    if (this->isShownIn(view) && view->widget() != nullptr && view->widget()->isVisible())
      this->ToDraw.append(view);
  }
  this->Showing.start();
  pv::renderViewsOf(this->Source);
}

/// Says what the views have yet to show. They draw rough pictures at first, with the last VDI until the next
/// one is loaded.
void pqVDIRegenerator::lookWhatIsShown() {
  if (this->Now == State::Preparing || this->Restarts > mostRestarts)
    return;  // these have notes of their own
  if (!pv::mayAsk(this->Source->getServer())) return;
  this->ToDraw.removeAll(nullptr);
  bool isLoading = !this->ToDraw.isEmpty();
  bool isRough = false;
  for (pqView* view : this->Source->getViews()) {
    if (!this->isShownIn(view)) continue;
    bool showsLast = this->ToDraw.contains(view);
    for (const vtkVDIProp* vdi : pv::vdisOf(view)) {
      showsLast |= vdi->IsLoading();
      isRough |= vdi->IsBehind();
    }
    isLoading |= showsLast;
    if (!showsLast && this->Defers) this->followShown(view);
  }
  if (!isLoading && !isRough) this->Showing.stop();
  this->note(isLoading ? tr("Loading the VDI into the view")
             : isRough ? tr("Refining the picture")
                       : QString());
}

QString pqVDIRegenerator::regenerate(pqView* view) {
  const bool made = this->Source->modifiedState() != pqProxy::UNINITIALIZED;
  const bool idle = this->Now == State::Idle;
  if (made) this->hold(0);
  BEGIN_UNDO_SET(tr("Regenerate VDI"));
  const std::string why = this->generator()->SetViewpoint(view != nullptr ? view->getViewProxy() : nullptr);
  END_UNDO_SET();
  if (made && idle && !why.empty()) this->finish();
  return QString::fromStdString(why);
}

void pqVDIRegenerator::setAutoView(pqView* view) {
  if (this->AutoView == view) return;
  this->AutoView = view;
  this->Tried = false;
  Q_EMIT this->autoViewChanged();
}

vtkSMRenderViewProxy* pqVDIRegenerator::followedView() {
  if (this->AutoView == nullptr) {
    pqView* active = pqActiveObjects::instance().activeView();
    if (active == nullptr || !this->isShownIn(active)) return nullptr;
    this->setAutoView(active);
  }
  if (!this->isShownIn(this->AutoView)) return nullptr;
  return vtkSMVDIGeneratorProxy::RenderViewOf(this->AutoView->getViewProxy());
}

/// Auto belongs to the view in which it is turned on, until it is turned on again.
void pqVDIRegenerator::autoChanged() {
  this->Tried = false;
  const bool on = vtkSMPropertyHelper(this->generator(), "Auto").GetAsInt() != 0;
  if (on && this->IsAuto) return;
  this->IsAuto = on;
  pqView* active = pqActiveObjects::instance().activeView();
  this->setAutoView(on && active != nullptr && this->isShownIn(active) ? active : nullptr);
}

/// The panel's box begins with the input's bounds, as soon as a user ticks Cropping.
void pqVDIRegenerator::croppingChanged() {
  this->generator()->BeginCropping();
}

/// After an undo, Auto leaves the viewpoint alone until the camera moves again.
void pqVDIRegenerator::leaveToUser() {
  vtkSMRenderViewProxy* view = this->followedView();
  if (view == nullptr) return;
  this->LastCamera = numbersOf(view->GetActiveCamera());
  this->Tried = true;
}

void pqVDIRegenerator::lookAtViews() {
  if (!pv::mayAsk(this->Source->getServer())) return;
  vtkSMVDIGeneratorProxy* own = this->generator();
  if (vtkSMPropertyHelper(own, "Auto").GetAsInt() == 0 || this->Now != State::Idle ||
      this->Source->modifiedState() == pqProxy::UNINITIALIZED)
    return;
  vtkSMRenderViewProxy* view = this->followedView();
  if (view == nullptr) return;
  const std::array<double, 10> camera = numbersOf(view->GetActiveCamera());
  const bool moves = camera != this->LastCamera;
  this->LastCamera = camera;
  if (moves) this->Tried = false;
  // The mouse may be pressed for something other than the camera, for example on Undo.
  if (moves || this->Tried || QApplication::mouseButtons() != Qt::NoButton) return;
  this->Tried = true;
  if (own->DegreesFrom(view) > vtkSMPropertyHelper(own, "AutoAngle").GetAsDouble())
    this->regenerate(this->AutoView);
}
