#include "VDISession.h"

#include <mpi.h>
#include <vtkMPI.h>
#include <vtkMPICommunicator.h>
#include <vtkMultiProcessController.h>
#include <vtkProcessModule.h>

#include <mutex>

#include "VDICollective.h"
#include "VDIVolume.h"
#include "vdi/core/Error.h"

namespace pv {

vdi::comm::Communicator communicatorOf(vtkMultiProcessController* controller) {
  auto* communicator =
      controller != nullptr ? vtkMPICommunicator::SafeDownCast(controller->GetCommunicator()) : nullptr;
  if (communicator == nullptr || controller->GetNumberOfProcesses() == 1)
    return vdi::comm::Communicator::serial();
  return vdi::comm::Communicator::fromMpi(MPI_Comm_c2f(*communicator->GetMPIComm()->GetHandle()));
}

bool isServer() {
  switch (vtkProcessModule::GetProcessType()) {
    case vtkProcessModule::PROCESS_SERVER:
    case vtkProcessModule::PROCESS_DATA_SERVER:
    case vtkProcessModule::PROCESS_RENDER_SERVER:
      return true;
    default:
      return false;
  }
}

void enterCollective(vtkMultiProcessController* controller, const std::string& operation) {
  if (controller == nullptr) return;
  CollectiveEntry entry{operation, {}};
  controller->InvokeEvent(CollectiveEntry::event, &entry);
  if (!entry.refusal.empty()) throw vdi::Error(vdi::ErrorCode::RemoteRank, entry.refusal);
}

bool isWatched(vtkMultiProcessController* controller) {
  return controller != nullptr && controller->HasObserver(CollectiveEntry::event) != 0;
}

namespace {

struct Existing {
  std::mutex mutex;
  std::weak_ptr<vdi::gpu::Device> device;
  std::weak_ptr<Volumes> volumes;
};

Existing& existing() {
  static Existing shared;
  return shared;
}

}  // namespace

std::shared_ptr<vdi::gpu::Device> sharedDevice(int localRank) {
  const std::scoped_lock lock(existing().mutex);
  std::shared_ptr<vdi::gpu::Device> device = existing().device.lock();
  if (!device || device->isLost()) {
    device = vdi::gpu::Device::create(vdi::gpu::requestFromEnvironment(localRank));
    existing().device = device;
  }
  return device;
}

std::shared_ptr<Volumes> sharedVolumes() {
  const std::scoped_lock lock(existing().mutex);
  std::shared_ptr<Volumes> volumes = existing().volumes.lock();
  if (!volumes) existing().volumes = volumes = std::make_shared<Volumes>();
  return volumes;
}

}  // namespace pv
