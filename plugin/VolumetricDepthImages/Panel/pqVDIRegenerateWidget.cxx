#include "pqVDIRegenerateWidget.h"

#include <pqActiveObjects.h>
#include <pqCoreUtilities.h>
#include <pqUndoStack.h>
#include <pqView.h>
#include <vtkCommand.h>
#include <vtkSMProperty.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMTrace.h>
#include <vtkSMViewProxy.h>
#include <QCheckBox>
#include <QLabel>
#include <QPushButton>
#include <QVBoxLayout>

#include <string>

#include "pqVDIRegenerator.h"
#include "vtkSMVDIGeneratorProxy.h"

namespace {

constexpr int viewLookMilliseconds = 250;

}  // namespace

pqVDIRegenerateWidget::pqVDIRegenerateWidget(vtkSMProxy* proxy, vtkSMProperty*, QWidget* parent)
    : pqPropertyWidget(proxy, parent), Line(new QLabel(this)), Auto(new QCheckBox(tr("Auto"), this)) {
  this->setShowLabel(false);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  auto* button =
      new QPushButton(QIcon(":/VolumetricDepthImages/vdi.svg"), tr("Regenerate From This View"), this);
  button->setObjectName("Regenerate");
  button->setToolTip(tr("Regenerates the VDI from the camera of the active view, at its size"));
  layout->addWidget(button);
  this->connect(button, &QPushButton::clicked, this, &pqVDIRegenerateWidget::regenerate);
  this->Auto->setObjectName("Auto");
  this->Auto->setToolTip(
      tr("Regenerates the VDI automatically when this view's camera rests more than Auto Angle from the "
         "VDI's viewpoint"));
  layout->addWidget(this->Auto);
  // The line stands below and always keeps its room, so that nothing moves under the mouse.
  this->Line->setObjectName("RegenerateLine");
  this->Line->setWordWrap(true);
  this->Line->setMinimumHeight(this->Line->fontMetrics().lineSpacing());
  layout->addWidget(this->Line);
  this->Looking.setInterval(viewLookMilliseconds);
  this->connect(&this->Looking, &QTimer::timeout, this, &pqVDIRegenerateWidget::lookAgain);
  this->connect(this->Auto, &QCheckBox::clicked, this, &pqVDIRegenerateWidget::setAuto);
  pqCoreUtilities::connect(proxy->GetProperty("Auto"), vtkCommand::ModifiedEvent, this, SLOT(showAuto()));
  this->connect(&pqActiveObjects::instance(), &pqActiveObjects::viewChanged, this,
                &pqVDIRegenerateWidget::showAuto);
  if (auto* regenerator = pqVDIRegenerator::of(vtkSMVDIGeneratorProxy::SafeDownCast(proxy))) {
    this->connect(regenerator, &pqVDIRegenerator::noted, this, &pqVDIRegenerateWidget::showNote);
    this->Line->setText(regenerator->lastNote());
    this->connect(regenerator, &pqVDIRegenerator::autoViewChanged, this, &pqVDIRegenerateWidget::showAuto);
  }
  this->showAuto();
}

pqVDIRegenerateWidget::~pqVDIRegenerateWidget() = default;

/// Runs at Apply in the panel alone: scripts don't call it.
void pqVDIRegenerateWidget::apply() {
  this->pqPropertyWidget::apply();
  if (auto* regenerator = pqVDIRegenerator::of(vtkSMVDIGeneratorProxy::SafeDownCast(this->proxy())))
    regenerator->applies();
}

void pqVDIRegenerateWidget::regenerate() {
  auto* regenerator = pqVDIRegenerator::of(vtkSMVDIGeneratorProxy::SafeDownCast(this->proxy()));
  if (regenerator == nullptr) return;  // it is no filter of the pipeline
  const QString why = regenerator->regenerate(pqActiveObjects::instance().activeView());
  this->Line->setText(why);
  if (!why.isEmpty()) this->Looking.start();
}

/// Clears the line once its reason is gone: another view is active, the view is back in 3-D mode, or its
/// camera has moved.
void pqVDIRegenerateWidget::lookAgain() {
  auto* generator = vtkSMVDIGeneratorProxy::SafeDownCast(this->proxy());
  pqView* view = pqActiveObjects::instance().activeView();
  const std::string why = generator->WhyNotFrom(view != nullptr ? view->getViewProxy() : nullptr);
  if (this->Line->text() == QString::fromStdString(why)) return;
  this->Looking.stop();
  this->Line->clear();
}

void pqVDIRegenerateWidget::setAuto(bool on) {
  BEGIN_UNDO_SET(tr("Auto"));
  {
    SM_SCOPED_TRACE(PropertiesModified).arg("proxy", this->proxy());
    vtkSMPropertyHelper(this->proxy(), "Auto").Set(on ? 1 : 0);
    this->proxy()->UpdateVTKObjects();
  }
  END_UNDO_SET();
}

void pqVDIRegenerateWidget::showAuto() {
  const bool on = vtkSMPropertyHelper(this->proxy(), "Auto").GetAsInt() != 0;
  this->Auto->setChecked(on);
  auto* regenerator = pqVDIRegenerator::of(vtkSMVDIGeneratorProxy::SafeDownCast(this->proxy()));
  pqView* view = regenerator != nullptr ? regenerator->autoView() : nullptr;
  const bool elsewhere = on && view != nullptr && view != pqActiveObjects::instance().activeView();
  this->Auto->setText(elsewhere ? tr("Auto, in %1").arg(view->getSMName()) : tr("Auto"));
}

void pqVDIRegenerateWidget::showNote(const QString& note) {
  this->Looking.stop();
  this->Line->setText(note);
}
