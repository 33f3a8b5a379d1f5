// Renders still frames in ParaView's window again when there is more to show. These frames don't wait for
// VDIs (vtkVDIProp::FrameKind).
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
  /// Serves all render views, present and future, until its end. Views within a comparative view render
  /// without a signal, so they wait.
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
