// Property widget `vdi_regenerate`: a button that makes the VDI anew from the active view, and a line that
// says how far that is, or why it can't be; and a box that sets Auto at once, without Apply: it changes no
// data.
#ifndef pqVDIRegenerateWidget_h
#define pqVDIRegenerateWidget_h

#include <pqPropertyWidget.h>
#include <QTimer>

class QCheckBox;
class QLabel;

class pqVDIRegenerateWidget : public pqPropertyWidget {
  Q_OBJECT

 public:
  pqVDIRegenerateWidget(vtkSMProxy* proxy, vtkSMProperty* property, QWidget* parent = nullptr);
  ~pqVDIRegenerateWidget() override;

  void apply() override;

 private:
  Q_SLOT void regenerate();
  Q_SLOT void setAuto(bool on);
  Q_SLOT void showAuto();
  Q_SLOT void lookAgain();
  Q_SLOT void showProgress(int percent);

  QLabel* Line;
  QCheckBox* Auto;
  QTimer Looking;  // while the line says why it can't be
};

#endif
