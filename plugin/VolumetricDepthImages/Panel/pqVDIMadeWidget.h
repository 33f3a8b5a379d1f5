// The property widget `vdi_made` of the readers: properties of the VDI, and a button that moves the active
// view's camera to the VDI's viewpoint.
#ifndef pqVDIMadeWidget_h
#define pqVDIMadeWidget_h

#include <pqPropertyWidget.h>

class QLabel;
class QPushButton;

class pqVDIMadeWidget : public pqPropertyWidget {
  Q_OBJECT

 public:
  pqVDIMadeWidget(vtkSMProxy* proxy, vtkSMProperty* property, QWidget* parent = nullptr);
  ~pqVDIMadeWidget() override;

 private:
  Q_SLOT void read();
  Q_SLOT void lookAsMade();

  QLabel* Text;
  QPushButton* Button;
};

#endif
