// Started with the plugin: gives each VolumetricDepthImage of the pipeline a pqVDIRegenerator.
#ifndef pqVDIBehavior_h
#define pqVDIBehavior_h

#include <QObject>

class pqPipelineSource;

class pqVDIBehavior : public QObject {
  Q_OBJECT

 public:
  void startup();
  void shutdown();

 private:
  Q_SLOT void sourceAdded(pqPipelineSource* source);
};

#endif
