#include "pqVDIColorsWidget.h"

#include <pqActiveObjects.h>
#include <pqCoreUtilities.h>
#include <pqDataRepresentation.h>
#include <pqProxyWidgetDialog.h>
#include <vtkCommand.h>
#include <vtkSMProperty.h>
#include <vtkSMPropertyHelper.h>
#include <QLabel>
#include <QPushButton>
#include <QVBoxLayout>

pqVDIColorsWidget::pqVDIColorsWidget(vtkSMProxy* proxy, vtkSMProperty*, QWidget* parent)
    : pqPropertyWidget(proxy, parent),
      Button(new QPushButton(QIcon(":/pqWidgets/Icons/pqEditColor.svg"), tr("Edit Color Map and Opacity"),
                             this)),
      Line(new QLabel(tr("Show the VDI in the active view first."), this)) {
  this->setShowLabel(false);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  this->Button->setObjectName("EditColors");
  layout->addWidget(this->Button);
  this->Line->setWordWrap(true);
  this->Line->hide();
  layout->addWidget(this->Line);
  this->connect(this->Button, &QPushButton::clicked, this, &pqVDIColorsWidget::edit);
  pqCoreUtilities::connect(proxy->GetProperty("LookupTable"), vtkCommand::ModifiedEvent, this,
                           SLOT(mapChanged()));
  // Before the dialog is there, so that these come before its own: ParaView's editor takes it for granted
  // that something is shown in the active view.
  const pqActiveObjects& active = pqActiveObjects::instance();
  this->connect(&active, QOverload<pqDataRepresentation*>::of(&pqActiveObjects::representationChanged), this,
                &pqVDIColorsWidget::closeWhereNothingIsShown);
  this->connect(&active, QOverload<pqRepresentation*>::of(&pqActiveObjects::representationChanged), this,
                &pqVDIColorsWidget::closeWhereNothingIsShown);
  this->connect(&active, &pqActiveObjects::viewChanged, this, &pqVDIColorsWidget::closeWhereNothingIsShown);
  this->mapChanged();
}

pqVDIColorsWidget::~pqVDIColorsWidget() {
  delete this->Dialog;
}

void pqVDIColorsWidget::mapChanged() {
  delete this->Dialog;
  const bool there = vtkSMPropertyHelper(this->proxy(), "LookupTable").GetAsProxy() != nullptr;
  this->Button->setEnabled(there);
  this->Button->setToolTip(there ? tr("The VDI is made anew once a change is done")
                                 : tr("The first Apply takes the map by which the view shows the volume"));
}

void pqVDIColorsWidget::closeWhereNothingIsShown() {
  if (pqActiveObjects::instance().activeRepresentation() == nullptr) delete this->Dialog;
}

void pqVDIColorsWidget::edit() {
  vtkSMProxy* map = vtkSMPropertyHelper(this->proxy(), "LookupTable").GetAsProxy();
  if (map == nullptr) return;  // the button is off then
  const bool shown = pqActiveObjects::instance().activeRepresentation() != nullptr;
  this->Line->setVisible(!shown);
  if (!shown) return;
  if (!this->Dialog) {
    auto* dialog = new pqProxyWidgetDialog(map, pqCoreUtilities::mainWidget());
    dialog->setObjectName("VDIColors");
    dialog->setWindowTitle(tr("Color Map and Opacity of the VDI"));
    dialog->setApplyChangesImmediately(true);
    dialog->setEnableSearchBar(true);
    dialog->setAttribute(Qt::WA_DeleteOnClose);
    this->Dialog = dialog;
  }
  this->Dialog->show();
  this->Dialog->raise();
}
