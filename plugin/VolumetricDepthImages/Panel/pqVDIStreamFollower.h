// Makes the views show the VDIs that a source VDIStream receives, and reports the state of its connection.
// The source's own threads receive and decode. This object asks from time to time for something new, and
// never waits.
#ifndef pqVDIStreamFollower_h
#define pqVDIStreamFollower_h

#include <QObject>
#include <QString>
#include <QTimer>

class pqPipelineSource;
class vtkSMProxy;

class pqVDIStreamFollower : public QObject {
  Q_OBJECT

 public:
  /// `source` is a VDIStream, which owns this object.
  explicit pqVDIStreamFollower(pqPipelineSource* source);
  ~pqVDIStreamFollower() override;

  /// The follower of a proxy; null if the proxy is no VDIStream of the pipeline.
  static pqVDIStreamFollower* of(vtkSMProxy* proxy);
  /// The state of the source's connection; empty before the first Apply.
  const QString& line() const { return this->Line; }
  /// Moves the active view to the VDI's viewpoint: now, or once there is a first VDI.
  void lookFromViewpoint();

 Q_SIGNALS:
  void lineChanged();

 private:
  Q_SLOT void look();

  pqPipelineSource* Source;
  QTimer Looking;
  QString Line;
  int Seen = 0;                // arrivals seen so far
  bool WaitsForFirst = false;  // a first VDI will move the view to its viewpoint
};

#endif
