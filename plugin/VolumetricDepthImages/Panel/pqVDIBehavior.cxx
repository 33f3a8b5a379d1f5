#include "pqVDIBehavior.h"

#include <pqApplicationCore.h>
#include <pqCoreUtilities.h>
#include <pqObjectBuilder.h>
#include <pqPipelineSource.h>
#include <pqPluginManager.h>
#include <pqPropertiesPanel.h>
#include <pqServer.h>
#include <pqServerManagerModel.h>
#include <vtkOutputWindow.h>
#include <vtkPVPluginsInformation.h>
#include <vtkSMPluginManager.h>
#include <vtkSMProxyManager.h>
#include <vtkSMSession.h>
#include <vtkSMTrace.h>
#include <QCoreApplication>
#include <QEvent>
#include <QTimer>

#include <initializer_list>
#include <string_view>

#include "VDIServer.h"
#include "VDISession.h"
#include "VDIViewpoint.h"
#include "pqVDIRegenerator.h"
#include "pqVDISaveData.h"
#include "pqVDIStillFrames.h"
#include "pqVDIStreamFollower.h"
#include "vtkSMVDIGeneratorProxy.h"

namespace {

bool isLoadedOn(pqServer* server) {
  if (!pv::isConnected(server->session())) return true;  // it can't be asked
  vtkPVPluginsInformation* plugins =
      vtkSMProxyManager::GetProxyManager()->GetPluginManager()->GetRemoteInformation(server->session());
  if (plugins == nullptr) return true;  // the plugins aren't known yet
  for (unsigned int i = 0; i < plugins->GetNumberOfPlugins(); ++i) {
    if (std::string_view(plugins->GetPluginName(i)) == "VolumetricDepthImages" && plugins->GetPluginLoaded(i))
      return true;
  }
  return false;
}

}  // namespace

void pqVDIBehavior::startup() {
  new pqVDIStillFrames(this);
  new pqVDISaveData(this);
  QCoreApplication::instance()->installEventFilter(this);
  pqServerManagerModel* model = pqApplicationCore::instance()->getServerManagerModel();
  this->connect(model, &pqServerManagerModel::sourceAdded, this, &pqVDIBehavior::sourceAdded);
  for (pqPipelineSource* source : model->findItems<pqPipelineSource*>()) this->sourceAdded(source);
  this->connect(pqApplicationCore::instance()->getObjectBuilder(), &pqObjectBuilder::filterCreated, this,
                &pqVDIBehavior::filterCreated);
  // Queued, so that it runs after the code that loads plugins for a new server.
  this->connect(model, &pqServerManagerModel::serverAdded, this, &pqVDIBehavior::lookAtServers,
                Qt::QueuedConnection);
  this->connect(pqApplicationCore::instance()->getPluginManager(), &pqPluginManager::pluginsUpdated, this,
                &pqVDIBehavior::lookAtServers, Qt::QueuedConnection);
  this->lookAtServers();
}

bool pqVDIBehavior::eventFilter(QObject* watched, QEvent* event) {
  // ParaView's progress bar lets timers run in the middle of an update, and some draw views. VTK's pipelines
  // and ParaView's views don't survive an update within an update. A timer that lost its event fires again.
  if (event->type() == QEvent::Timer && pv::RunningUpdate::exists()) return true;
  return QObject::eventFilter(watched, event);
}

/// Called when a user has made the filter from the menu.
void pqVDIBehavior::filterCreated(pqPipelineSource* source) {
  auto* generator = vtkSMVDIGeneratorProxy::SafeDownCast(source->getProxy());
  if (generator == nullptr) return;
  SM_SCOPED_TRACE(PropertiesModified).arg("proxy", generator).arg("comment", "what the view shows");
  generator->TakeArrayFromView();
  generator->UpdateVTKObjects();
}

void pqVDIBehavior::lookAtServers() {
  pqApplicationCore* core = pqApplicationCore::instance();
  if (core == nullptr) return;
  this->Lacking.removeAll(nullptr);
  for (pqServer* server : core->getServerManagerModel()->findItems<pqServer*>()) {
    if (!server->isRemote() || isLoadedOn(server)) {
      this->Lacking.removeAll(server);
    } else if (!this->Lacking.contains(server)) {
      this->Lacking.append(server);
      vtkOutputWindowDisplayWarningText(
          "The server lacks the plugin VolumetricDepthImages: load it below Remote Plugins in Tools > Manage "
          "Plugins.\n");
    }
  }
}

void pqVDIBehavior::shutdown() {
  if (QCoreApplication::instance() != nullptr) QCoreApplication::instance()->removeEventFilter(this);
  // Deletes pqVDIStillFrames here: the list of views that it empties no longer exists at this object's end.
  delete this->findChild<pqVDIStillFrames*>();
  // The sources own the objects that this one has made.
  pqApplicationCore* core = pqApplicationCore::instance();
  if (core == nullptr) return;
  for (QObject* sender : std::initializer_list<QObject*>{
           core->getServerManagerModel(), core->getPluginManager(), core->getObjectBuilder()}) {
    if (sender != nullptr) sender->disconnect(this);  // some no longer exist
  }
}

void pqVDIBehavior::sourceAdded(pqPipelineSource* source) {
  if (vtkSMVDIGeneratorProxy::SafeDownCast(source->getProxy()) != nullptr) new pqVDIRegenerator(source);
  const std::string_view name(source->getProxy()->GetXMLName());
  if (name == "VDIStream") new pqVDIStreamFollower(source);
  if ((name != "VDIReader" && name != "VDIStream") || pqApplicationCore::instance()->isLoadingState())
    return;  // a state brings its camera
  // Listens only to Apply in the panel, because scripts set their cameras. The panels may be younger than
  // this object.
  QWidget* window = pqCoreUtilities::mainWidget();
  if (window == nullptr) return;
  for (pqPropertiesPanel* panel : window->findChildren<pqPropertiesPanel*>()) {
    this->connect(panel, SIGNAL(applied(pqProxy*)), this, SLOT(applied(pqProxy*)), Qt::UniqueConnection);
  }
  this->Opened.append(source);
}

void pqVDIBehavior::applied(pqProxy* proxy) {
  auto* source = qobject_cast<pqPipelineSource*>(proxy);
  if (source == nullptr || this->Opened.removeAll(source) == 0) return;
  // Runs after ParaView has shown the source and reset the camera.
  QTimer::singleShot(0, source, [source] {
    if (auto* follower = pqVDIStreamFollower::of(source->getProxy())) {
      follower->lookFromViewpoint();
    } else {
      pv::lookFromViewpointOf(source);
    }
  });
}
