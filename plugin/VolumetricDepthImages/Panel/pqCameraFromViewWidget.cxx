#include "pqCameraFromViewWidget.h"

#include <pqActiveObjects.h>
#include <pqApplicationCore.h>
#include <pqPipelineSource.h>
#include <pqServerManagerModel.h>
#include <pqUndoStack.h>
#include <pqView.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMRenderViewProxy.h>
#include <vtkSMTrace.h>
#include <QLabel>
#include <QPushButton>
#include <QVBoxLayout>

#include <string>

#include "vtkSMVDIGeneratorProxy.h"

pqCameraFromViewWidget::pqCameraFromViewWidget(vtkSMProxy* proxy, vtkSMProperty*, QWidget* parent)
    : pqPropertyWidget(proxy, parent), Line(new QLabel(this)) {
  this->setShowLabel(false);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  auto* button = new QPushButton(tr("Use the active view's camera"), this);
  button->setObjectName("CameraFromView");
  button->setToolTip(tr("Looks at the VDI from the active view's camera, and turns Use Original Camera off"));
  layout->addWidget(button);
  this->Line->setWordWrap(true);
  this->Line->hide();
  layout->addWidget(this->Line);
  constexpr int lookMilliseconds = 250;
  this->Looking.setInterval(lookMilliseconds);
  this->connect(&this->Looking, &QTimer::timeout, this, &pqCameraFromViewWidget::lookAgain);
  this->connect(button, &QPushButton::clicked, this, &pqCameraFromViewWidget::copyCamera);
}

pqCameraFromViewWidget::~pqCameraFromViewWidget() = default;

void pqCameraFromViewWidget::copyCamera() {
  pqView* view = pqActiveObjects::instance().activeView();
  vtkSMViewProxy* from = view != nullptr ? view->getViewProxy() : nullptr;
  const std::string why = vtkSMVDIGeneratorProxy::WhyNot(from);
  this->Line->setText(QString::fromStdString(why));
  this->Line->setVisible(!why.empty());
  if (!why.empty()) {
    this->Looking.start();
    return;
  }
  BEGIN_UNDO_SET(tr("Use the view's camera"));
  {
    SM_SCOPED_TRACE(PropertiesModified).arg("proxy", this->proxy()).arg("comment", "the view's camera");
    vtkSMVDIGeneratorProxy::SetCamera(this->proxy(), vtkSMVDIGeneratorProxy::RenderViewOf(from));
    vtkSMPropertyHelper(this->proxy(), "UseOriginalCamera").Set(0);
    this->proxy()->UpdateVTKObjects();
  }
  END_UNDO_SET();
  if (auto* source =
          pqApplicationCore::instance()->getServerManagerModel()->findItem<pqPipelineSource*>(this->proxy()))
    source->renderAllViews();
}

/// Clears the line once its reason is gone: another view is active, or the view is back in 3-D mode.
void pqCameraFromViewWidget::lookAgain() {
  pqView* view = pqActiveObjects::instance().activeView();
  const std::string why = vtkSMVDIGeneratorProxy::WhyNot(view != nullptr ? view->getViewProxy() : nullptr);
  if (this->Line->text() == QString::fromStdString(why)) return;
  this->Looking.stop();
  this->Line->hide();
}
