// Has the views show what a source VDIStream receives, and says how its connection is. The source's own
// threads receive and decode; this asks from time to time whether there's something new, and never waits.
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
  /// `source` is a VDIStream; owns this.
  explicit pqVDIStreamFollower(pqPipelineSource* source);
  ~pqVDIStreamFollower() override;

  /// That of a proxy, null if it's no source of the pipeline.
  static pqVDIStreamFollower* of(vtkSMProxy* proxy);
  /// What the source says of its connection; empty before the first Apply.
  const QString& line() const { return this->Line; }
  /// Has the active view look from where the VDI was made: now, or once the first one is there.
  void lookFromViewpoint();

 Q_SIGNALS:
  void lineChanged();

 private:
  Q_SLOT void look();

  pqPipelineSource* Source;
  QTimer Looking;
  QString Line;
  int Seen = 0;                // arrivals
  bool WaitsForFirst = false;  // for the view to look from its viewpoint
};

#endif
