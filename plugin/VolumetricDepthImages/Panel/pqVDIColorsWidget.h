// The property widget `vdi_colors`: a button that opens the colour map and the opacity function of a
// VolumetricDepthImage.
#ifndef pqVDIColorsWidget_h
#define pqVDIColorsWidget_h

#include <pqPropertyWidget.h>
#include <vtkSmartPointer.h>
#include <QPointer>

#include <utility>
#include <vector>

class QDialog;
class QLabel;
class QPushButton;
class vtkSMProxy;

class pqVDIColorsWidget : public pqPropertyWidget {
  Q_OBJECT

 public:
  pqVDIColorsWidget(vtkSMProxy* proxy, vtkSMProperty* property, QWidget* parent = nullptr);
  ~pqVDIColorsWidget() override;

 private:
  Q_SLOT void edit();
  Q_SLOT void mapChanged();
  Q_SLOT void closeWhereNothingIsShown();
  Q_SLOT void restore();
  void keepMaps(vtkSMProxy* map);

  QPushButton* Button;
  QLabel* Line;
  QPointer<QDialog> Dialog;
  /// The maps that the dialog edits, and copies of them from before it opened.
  std::vector<std::pair<vtkSmartPointer<vtkSMProxy>, vtkSmartPointer<vtkSMProxy>>> Kept;
};

#endif
