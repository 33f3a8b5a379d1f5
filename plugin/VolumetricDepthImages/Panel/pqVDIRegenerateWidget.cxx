#include "pqVDIRegenerateWidget.h"

#include <pqActiveObjects.h>
#include <pqCoreUtilities.h>
#include <pqUndoStack.h>
#include <vtkCommand.h>
#include <vtkSMProperty.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMTrace.h>
#include <QCheckBox>
#include <QLabel>
#include <QPushButton>
#include <QVBoxLayout>

#include "pqVDIRegenerator.h"
#include "vtkSMVDIGeneratorProxy.h"

pqVDIRegenerateWidget::pqVDIRegenerateWidget(vtkSMProxy* proxy, vtkSMProperty*, QWidget* parent)
    : pqPropertyWidget(proxy, parent), Line(new QLabel(this)), Auto(new QCheckBox(tr("Auto"), this)) {
  this->setShowLabel(false);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  auto* button =
      new QPushButton(QIcon(":/VolumetricDepthImages/vdi.svg"), tr("Regenerate From This View"), this);
  button->setObjectName("Regenerate");
  button->setToolTip(tr("Makes the VDI anew from the camera of the active view, at its size"));
  layout->addWidget(button);
  this->Line->setObjectName("RegenerateLine");
  this->Line->setWordWrap(true);
  this->Line->hide();
  layout->addWidget(this->Line);
  this->connect(button, &QPushButton::clicked, this, &pqVDIRegenerateWidget::regenerate);
  this->Auto->setObjectName("Auto");
  this->Auto->setToolTip(tr(
      "Makes the VDI anew by itself, once the view's camera rests more than Auto Angle away from where the "
      "VDI was made"));
  layout->addWidget(this->Auto);
  this->connect(this->Auto, &QCheckBox::clicked, this, &pqVDIRegenerateWidget::setAuto);
  pqCoreUtilities::connect(proxy->GetProperty("Auto"), vtkCommand::ModifiedEvent, this, SLOT(showAuto()));
  this->showAuto();
  if (auto* regenerator = pqVDIRegenerator::of(vtkSMVDIGeneratorProxy::SafeDownCast(proxy)))
    this->connect(regenerator, &pqVDIRegenerator::progress, this, &pqVDIRegenerateWidget::showProgress);
}

pqVDIRegenerateWidget::~pqVDIRegenerateWidget() = default;

void pqVDIRegenerateWidget::regenerate() {
  auto* regenerator = pqVDIRegenerator::of(vtkSMVDIGeneratorProxy::SafeDownCast(this->proxy()));
  if (regenerator == nullptr) return;  // not a filter of the pipeline
  const QString why = regenerator->regenerate(pqActiveObjects::instance().activeView());
  this->Line->setText(why);
  this->Line->setVisible(!why.isEmpty());
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
  this->Auto->setChecked(vtkSMPropertyHelper(this->proxy(), "Auto").GetAsInt() != 0);
}

void pqVDIRegenerateWidget::showProgress(int percent) {
  this->Line->setText(tr("Making the VDI anew: %1 %").arg(percent));
  this->Line->setVisible(percent >= 0);
}
