// The property widget `vdi_stream` of the source VDIStream: the state of its connection, and a box that sets
// Pause at once, without Apply.
#ifndef pqVDIStreamWidget_h
#define pqVDIStreamWidget_h

#include <pqPropertyWidget.h>

class QCheckBox;
class QLabel;

class pqVDIStreamWidget : public pqPropertyWidget {
  Q_OBJECT

 public:
  pqVDIStreamWidget(vtkSMProxy* proxy, vtkSMProperty* property, QWidget* parent = nullptr);
  ~pqVDIStreamWidget() override;

  void apply() override;

 private:
  Q_SLOT void showLine();
  Q_SLOT void setPause(bool on);
  Q_SLOT void showPause();

  QLabel* Line;
  QCheckBox* Pause;
};

#endif
