#include "VDISession.h"

#include <mpi.h>
#include <vtkCommunicator.h>
#include <vtkMPI.h>
#include <vtkMPICommunicator.h>
#include <vtkMultiProcessController.h>
#include <vtkProcessModule.h>

#include <mutex>

#include "VDICollective.h"
#include "vdi/core/Error.h"

namespace pv {

int RunningUpdate::count_ = 0;

vdi::comm::Communicator communicatorOf(vtkMultiProcessController* controller) {
  auto* communicator =
      controller != nullptr ? vtkMPICommunicator::SafeDownCast(controller->GetCommunicator()) : nullptr;
  if (communicator == nullptr || controller->GetNumberOfProcesses() == 1)
    return vdi::comm::Communicator::serial();
  return vdi::comm::Communicator::fromMpi(MPI_Comm_c2f(*communicator->GetMPIComm()->GetHandle()));
}

bool isRoot() {
  vtkMultiProcessController* controller = vtkMultiProcessController::GetGlobalController();
  return controller == nullptr || controller->GetLocalProcessId() == 0;
}

bool onAllRanks(vtkMultiProcessController* controller, bool here) {
  if (controller == nullptr || controller->GetNumberOfProcesses() == 1) return here;
  const int mine = here ? 1 : 0;
  int all = 0;
  controller->AllReduce(&mine, &all, 1, vtkCommunicator::MIN_OP);
  return all != 0;
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

std::shared_ptr<vdi::gpu::Device> sharedDevice(int localRank) {
  static std::mutex mutex;
  static std::weak_ptr<vdi::gpu::Device> existing;
  const std::scoped_lock lock(mutex);
  std::shared_ptr<vdi::gpu::Device> device = existing.lock();
  if (!device || device->isLost()) {
    device = vdi::gpu::Device::create(vdi::gpu::requestFromEnvironment(localRank));
    existing = device;
  }
  return device;
}

}  // namespace pv
