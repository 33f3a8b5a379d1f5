// Property widget `vdi_camera_from_view`: a button that copies the active view's camera into the proxy's
// Camera properties.
#ifndef pqCameraFromViewWidget_h
#define pqCameraFromViewWidget_h

#include <pqPropertyWidget.h>

class pqCameraFromViewWidget : public pqPropertyWidget {
  Q_OBJECT

 public:
  pqCameraFromViewWidget(vtkSMProxy* proxy, vtkSMProperty* property, QWidget* parent = nullptr);
  ~pqCameraFromViewWidget() override;

 private Q_SLOTS:
  void copyCamera();
};

#endif
