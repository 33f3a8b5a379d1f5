// Started with the plugin: gives each VolumetricDepthImage of the pipeline a pqVDIRegenerator, has still
// frames deferred, and looks at what the user has opened from where it was made.
#ifndef pqVDIBehavior_h
#define pqVDIBehavior_h

#include <QList>
#include <QObject>
#include <QPointer>

class pqPipelineSource;
class pqProxy;

class pqVDIBehavior : public QObject {
  Q_OBJECT

 public:
  void startup();
  void shutdown();

 private:
  Q_SLOT void sourceAdded(pqPipelineSource* source);
  Q_SLOT void applied(pqProxy* proxy);

  QList<QPointer<pqPipelineSource>> Opened;  // readers that haven't been applied yet
};

#endif
