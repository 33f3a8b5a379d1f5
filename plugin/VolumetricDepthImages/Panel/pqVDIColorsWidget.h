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

 protected:
  /// Watches for mouse buttons in the dialog.
  bool eventFilter(QObject* watched, QEvent* event) override;

 private:
  Q_SLOT void edit();
  Q_SLOT void mapChanged();
  Q_SLOT void closeWhereNothingIsShown();
  Q_SLOT void restore();
  Q_SLOT void endDrag();
  void keepMaps(vtkSMProxy* map);

  QPushButton* Button;
  QLabel* Line;
  QPointer<QDialog> Dialog;
  bool IsDragging = false;  // a mouse button is down in the dialog, and a step for Undo is open
  /// The maps that the dialog edits, and copies of them from before it opened.
  std::vector<std::pair<vtkSmartPointer<vtkSMProxy>, vtkSmartPointer<vtkSMProxy>>> Kept;
};

#endif
