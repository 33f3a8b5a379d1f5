#include "pqVDIRegenerateWidget.h"

#include <pqActiveObjects.h>
#include <QLabel>
#include <QPushButton>
#include <QVBoxLayout>

#include "pqVDIRegenerator.h"
#include "vtkSMVDIGeneratorProxy.h"

pqVDIRegenerateWidget::pqVDIRegenerateWidget(vtkSMProxy* proxy, vtkSMProperty*, QWidget* parent)
    : pqPropertyWidget(proxy, parent), Line(new QLabel(this)) {
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

void pqVDIRegenerateWidget::showProgress(int percent) {
  this->Line->setText(tr("Making the VDI anew: %1 %").arg(percent));
  this->Line->setVisible(percent >= 0);
}
