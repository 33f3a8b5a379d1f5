// Still frames in ParaView's window don't wait for VDIs (vtkVDIProp::Frame). This renders again when there is
// more to show.
#ifndef pqVDIStillFrames_h
#define pqVDIStillFrames_h

#include <QList>
#include <QObject>
#include <QPointer>
#include <QTimer>

class pqView;

class pqVDIStillFrames : public QObject {
  Q_OBJECT

 public:
  /// Of all render views there are and will be, until it goes. Not of the views in a comparative view, which
  /// render without telling: these wait.
  explicit pqVDIStillFrames(QObject* parent);
  ~pqVDIStillFrames() override;
  bool eventFilter(QObject* watched, QEvent* event) override;

 private:
  Q_SLOT void viewAdded(pqView* view);
  Q_SLOT void begins();
  Q_SLOT void rendered();
  Q_SLOT void look();

  QTimer Looking;
  QList<QPointer<pqView>> Behind;
};

#endif
