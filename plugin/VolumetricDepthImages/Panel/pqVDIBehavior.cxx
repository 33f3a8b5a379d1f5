#include "pqVDIBehavior.h"

#include <pqApplicationCore.h>
#include <pqPipelineSource.h>
#include <pqServerManagerModel.h>

#include "pqVDIRegenerator.h"
#include "vtkSMVDIGeneratorProxy.h"

void pqVDIBehavior::startup() {
  pqServerManagerModel* model = pqApplicationCore::instance()->getServerManagerModel();
  this->connect(model, &pqServerManagerModel::sourceAdded, this, &pqVDIBehavior::sourceAdded);
  for (pqPipelineSource* source : model->findItems<pqPipelineSource*>()) this->sourceAdded(source);
}

void pqVDIBehavior::shutdown() {
  // What it made belongs to the sources.
  if (pqApplicationCore* core = pqApplicationCore::instance())
    this->disconnect(core->getServerManagerModel());
}

void pqVDIBehavior::sourceAdded(pqPipelineSource* source) {
  if (vtkSMVDIGeneratorProxy::SafeDownCast(source->getProxy()) != nullptr) new pqVDIRegenerator(source);
}
