// The property widget `vdi_regenerate`. It has a button that regenerates the VDI from the active view, and a
// line that says what the regenerator notes, or why the view can't be used. A box sets Auto at once,
// without Apply, because it changes no data.
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
  Q_SLOT void showNote(const QString& note);

  QLabel* Line;
  QCheckBox* Auto;
  QTimer Looking;  // runs while the line shows a reason
};

#endif
