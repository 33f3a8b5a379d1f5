#include "pqVDIStreamWidget.h"

#include <pqCoreUtilities.h>
#include <pqUndoStack.h>
#include <vtkCommand.h>
#include <vtkSMProperty.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMProxy.h>
#include <vtkSMTrace.h>
#include <QCheckBox>
#include <QLabel>
#include <QLineEdit>
#include <QSignalBlocker>
#include <QTimer>
#include <QVBoxLayout>

#include "pqVDIStreamFollower.h"

pqVDIStreamWidget::pqVDIStreamWidget(vtkSMProxy* proxy, vtkSMProperty*, QWidget* parent)
    : pqPropertyWidget(proxy, parent), Line(new QLabel(this)), Pause(new QCheckBox(tr("Pause"), this)) {
  this->setShowLabel(false);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  this->Pause->setObjectName("Pause");
  this->Pause->setToolTip(tr("Keeps showing the same VDI. The server sends no others while this is on"));
  layout->addWidget(this->Pause);
  this->Line->setObjectName("StreamLine");
  this->Line->setTextFormat(Qt::PlainText);  // the text comes in part from a server
  this->Line->setWordWrap(true);
  this->Line->setTextInteractionFlags(Qt::TextSelectableByMouse);
  this->Line->setMinimumHeight(2 * this->Line->fontMetrics().lineSpacing());
  layout->addWidget(this->Line);
  this->connect(this->Pause, &QCheckBox::clicked, this, &pqVDIStreamWidget::setPause);
  pqCoreUtilities::connect(proxy->GetProperty("Pause"), vtkCommand::ModifiedEvent, this, SLOT(showPause()));
  if (auto* follower = pqVDIStreamFollower::of(proxy))
    this->connect(follower, &pqVDIStreamFollower::lineChanged, this, &pqVDIStreamWidget::showLine);
  this->showLine();
  this->showPause();
}

pqVDIStreamWidget::~pqVDIStreamWidget() = default;

/// Shows the link without its token. The field of URL ignores changes during Apply, and a reset alone leaves
/// its text.
void pqVDIStreamWidget::apply() {
  pqPropertyWidget::apply();
  vtkSMProperty* url = this->proxy()->GetProperty("URL");
  QTimer::singleShot(0, this, [this, url] {
    for (auto* field : this->parentWidget()->findChildren<pqPropertyWidget*>()) {
      if (field->property() != url) continue;
      const QString text = vtkSMPropertyHelper(url).GetAsString();
      for (auto* editor : field->findChildren<QLineEdit*>()) {
        const QSignalBlocker quiet(editor);
        if (editor->text() != text) editor->setText(text);
      }
      field->reset();
    }
  });
}

void pqVDIStreamWidget::showLine() {
  const pqVDIStreamFollower* follower = pqVDIStreamFollower::of(this->proxy());
  this->Line->setText(follower != nullptr ? follower->line() : QString());
}

void pqVDIStreamWidget::setPause(bool on) {
  BEGIN_UNDO_SET(tr("Pause"));
  {
    SM_SCOPED_TRACE(PropertiesModified).arg("proxy", this->proxy());
    vtkSMPropertyHelper(this->proxy(), "Pause").Set(on ? 1 : 0);
    this->proxy()->UpdateVTKObjects();
  }
  END_UNDO_SET();
}

void pqVDIStreamWidget::showPause() {
  this->Pause->setChecked(vtkSMPropertyHelper(this->proxy(), "Pause").GetAsInt() != 0);
}
