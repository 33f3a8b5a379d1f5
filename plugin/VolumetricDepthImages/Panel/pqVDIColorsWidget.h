// Property widget `vdi_colors`: a button that opens the colour map and the opacity function of a
// VolumetricDepthImage.
#ifndef pqVDIColorsWidget_h
#define pqVDIColorsWidget_h

#include <pqPropertyWidget.h>
#include <QPointer>

class QDialog;
class QLabel;
class QPushButton;

class pqVDIColorsWidget : public pqPropertyWidget {
  Q_OBJECT

 public:
  pqVDIColorsWidget(vtkSMProxy* proxy, vtkSMProperty* property, QWidget* parent = nullptr);
  ~pqVDIColorsWidget() override;

 private:
  Q_SLOT void edit();
  Q_SLOT void mapChanged();
  Q_SLOT void closeWhereNothingIsShown();

  QPushButton* Button;
  QLabel* Line;
  QPointer<QDialog> Dialog;
};

#endif
