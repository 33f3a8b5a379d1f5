#include "pqVDIVectorWidget.h"

#include <pqDoubleLineEdit.h>
#include <vtkSMProperty.h>
#include <vtkSMVectorProperty.h>
#include <QGridLayout>
#include <QLabel>

#include <algorithm>

pqVDIVectorWidget::pqVDIVectorWidget(vtkSMProxy* proxy, vtkSMProperty* property, QWidget* parent)
    : pqPropertyWidget(proxy, parent) {
  this->setShowLabel(false);
  auto* layout = new QGridLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->setSpacing(4);
  auto* vector = vtkSMVectorProperty::SafeDownCast(property);
  const int count = vector != nullptr ? static_cast<int>(vector->GetNumberOfElements()) : 0;
  layout->addWidget(new QLabel(property->GetXMLLabel(), this), 0, 0, 1, std::max(count, 1));
  for (int element = 0; element < count; ++element) {
    auto* edit = new pqDoubleLineEdit(this);
    edit->setObjectName(QString("%1_%2").arg(property->GetXMLName()).arg(element));
    layout->addWidget(edit, 1, element);
    this->addPropertyLink(edit, "text2", SIGNAL(textChanged(const QString&)), property, element);
    this->connect(edit, &pqDoubleLineEdit::textChangedAndEditingFinished, this,
                  &pqVDIVectorWidget::changeFinished);
  }
  this->setChangeAvailableAsChangeFinished(false);
}

pqVDIVectorWidget::~pqVDIVectorWidget() = default;
