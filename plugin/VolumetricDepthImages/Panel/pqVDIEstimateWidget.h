// The property widget `vdi_estimate`: a line with the size of the VDI that the panel's numbers describe, and
// with the time that it will take, before Apply.
#ifndef pqVDIEstimateWidget_h
#define pqVDIEstimateWidget_h

#include <pqPropertyWidget.h>
#include <QTimer>

class QLabel;

class pqVDIEstimateWidget : public pqPropertyWidget {
  Q_OBJECT

 public:
  pqVDIEstimateWidget(vtkSMProxy* proxy, vtkSMProperty* property, QWidget* parent = nullptr);
  ~pqVDIEstimateWidget() override;

 private:
  Q_SLOT void estimate();

  QLabel* Line;
  QTimer Soon;  // waits, because several numbers change at once
};

#endif
