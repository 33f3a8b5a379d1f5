// The property widget `vdi_camera_from_view`: a button that sets a RenderVDI's camera to the active view's,
// and a line with the reason why it can't.
#ifndef pqCameraFromViewWidget_h
#define pqCameraFromViewWidget_h

#include <pqPropertyWidget.h>
#include <QTimer>

class QLabel;

class pqCameraFromViewWidget : public pqPropertyWidget {
  Q_OBJECT

 public:
  pqCameraFromViewWidget(vtkSMProxy* proxy, vtkSMProperty* property, QWidget* parent = nullptr);
  ~pqCameraFromViewWidget() override;

 private:
  Q_SLOT void copyCamera();
  Q_SLOT void lookAgain();

  QLabel* Line;
  QTimer Looking;  // runs while the line shows a reason
};

#endif
