#include "pqCameraFromViewWidget.h"

#include <pqActiveObjects.h>
#include <pqView.h>
#include <vtkSMProperty.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMViewProxy.h>
#include <QPushButton>
#include <QVBoxLayout>

#include <vector>

pqCameraFromViewWidget::pqCameraFromViewWidget(vtkSMProxy* proxy, vtkSMProperty*, QWidget* parent)
    : pqPropertyWidget(proxy, parent) {
  this->setShowLabel(false);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  auto* button = new QPushButton(tr("Use the active view's camera"), this);
  button->setObjectName("CameraFromView");
  button->setToolTip(
      tr("Copies position, focal point, view-up, angle, projection and scale of the active view's camera"));
  layout->addWidget(button);
  this->connect(button, &QPushButton::clicked, this, &pqCameraFromViewWidget::copyCamera);
}

pqCameraFromViewWidget::~pqCameraFromViewWidget() = default;

void pqCameraFromViewWidget::copyCamera() {
  pqView* view = pqActiveObjects::instance().activeView();
  vtkSMProxy* from = view != nullptr ? view->getProxy() : nullptr;
  vtkSMProxy* to = this->proxy();
  if (from == nullptr || from->GetProperty("CameraPosition") == nullptr) return;  // not a view with a camera
  from->UpdatePropertyInformation();
  for (const char* name : {"Position", "FocalPoint", "ViewUp", "ViewAngle", "ParallelScale"}) {
    const std::string property = std::string("Camera") + name;
    // The view's "...Info" properties hold what the user's mouse has done.
    const std::string info = property + "Info";
    const std::string source = from->GetProperty(info.c_str()) != nullptr ? info : property;
    const std::vector<double> values = vtkSMPropertyHelper(from, source.c_str()).GetDoubleArray();
    vtkSMPropertyHelper(to, property.c_str()).Set(values.data(), static_cast<unsigned int>(values.size()));
  }
  vtkSMPropertyHelper(to, "CameraParallelProjection")
      .Set(vtkSMPropertyHelper(from, "CameraParallelProjection").GetAsInt());
  Q_EMIT this->changeAvailable();
  Q_EMIT this->changeFinished();
}
