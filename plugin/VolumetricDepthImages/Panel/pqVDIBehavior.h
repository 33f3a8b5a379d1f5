// Starts with the plugin. It gives each VolumetricDepthImage of the pipeline a pqVDIRegenerator, has still
// frames deferred, has views follow each VDIStream, moves the view to the viewpoint of the VDI that the user
// opens, warns of servers that lack the plugin, and has timers wait while the window's own process makes a
// VDI.
#ifndef pqVDIBehavior_h
#define pqVDIBehavior_h

#include <QList>
#include <QObject>
#include <QPointer>

class pqPipelineSource;
class pqProxy;
class pqServer;

class pqVDIBehavior : public QObject {
  Q_OBJECT

 public:
  void startup();
  void shutdown();

 protected:
  /// Watches all objects, because timers of any of them draw views.
  bool eventFilter(QObject* watched, QEvent* event) override;

 private:
  Q_SLOT void sourceAdded(pqPipelineSource* source);
  Q_SLOT void filterCreated(pqPipelineSource* source);
  Q_SLOT void applied(pqProxy* proxy);
  Q_SLOT void lookAtServers();

  QList<QPointer<pqPipelineSource>> Opened;  // readers that haven't been applied yet
  QList<QPointer<pqServer>> Lacking;         // servers that lack the plugin, after the warning
};

#endif
