#include "pqVDIColorsWidget.h"

#include <pqCoreUtilities.h>
#include <pqProxyWidgetDialog.h>
#include <vtkCommand.h>
#include <vtkSMProperty.h>
#include <vtkSMPropertyHelper.h>
#include <QPushButton>
#include <QVBoxLayout>

pqVDIColorsWidget::pqVDIColorsWidget(vtkSMProxy* proxy, vtkSMProperty*, QWidget* parent)
    : pqPropertyWidget(proxy, parent),
      Button(new QPushButton(QIcon(":/pqWidgets/Icons/pqEditColor.svg"), tr("Edit Color Map and Opacity"), this)) {
  this->setShowLabel(false);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  this->Button->setObjectName("EditColors");
  layout->addWidget(this->Button);
  this->connect(this->Button, &QPushButton::clicked, this, &pqVDIColorsWidget::edit);
  pqCoreUtilities::connect(proxy->GetProperty("LookupTable"), vtkCommand::ModifiedEvent, this, SLOT(mapChanged()));
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

void pqVDIColorsWidget::edit() {
  vtkSMProxy* map = vtkSMPropertyHelper(this->proxy(), "LookupTable").GetAsProxy();
  if (map == nullptr) return;  // the button is off then
  if (!this->Dialog) {
    auto* dialog = new pqProxyWidgetDialog(map, pqCoreUtilities::mainWidget());
    dialog->setObjectName("VDIColors");
    dialog->setWindowTitle(tr("Color Map and Opacity of the VDI"));
    dialog->setApplyChangesImmediately(true);
    dialog->setEnableSearchBar(true);
    this->Dialog = dialog;
  }
  this->Dialog->show();
  this->Dialog->raise();
}
