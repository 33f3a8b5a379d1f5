// Objects that the filters of one process share: the Vulkan device and the communicator of a VTK controller.
#ifndef VDISession_h
#define VDISession_h

#include <memory>
#include <string>

#include "vdi/comm/Communicator.h"
#include "vdi/gpu/Device.h"

class vtkMultiProcessController;

namespace pv {

/// A communicator over a duplicate of the controller's MPI communicator (collective), or over this process
/// alone if the controller has none, or one process.
vdi::comm::Communicator communicatorOf(vtkMultiProcessController* controller);

/// Whether this process is the first of the global controller's.
bool isRoot();

/// Collective: whether `here` is true on all ranks of the controller. Null means this rank alone.
bool onAllRanks(vtkMultiProcessController* controller, bool here);

/// Whether this process belongs to a server, so that another process shows its output.
bool isServer();

/// Call it on all ranks before a collective operation. Throws vdi::Error{RemoteRank} if another rank won't
/// enter (VDICollective.h).
void enterCollective(vtkMultiProcessController* controller, const std::string& operation);
/// Whether a simulation's adaptor watches over such operations.
bool isWatched(vtkMultiProcessController* controller);

/// An update by the main thread that makes a VDI. It shows its progress, and ParaView's progress bar lets
/// timers run, which may request updates in the middle of this one.
class RunningUpdate {
 public:
  RunningUpdate() { ++count_; }
  ~RunningUpdate() { --count_; }
  RunningUpdate(const RunningUpdate&) = delete;
  RunningUpdate& operator=(const RunningUpdate&) = delete;
  RunningUpdate(RunningUpdate&&) = delete;
  RunningUpdate& operator=(RunningUpdate&&) = delete;
  /// Whether there is one, of any filter. Main thread.
  static bool exists() { return count_ > 0; }

 private:
  static int count_;
};

/// The process's device. The first call makes it, and it lives as long as a caller holds it. If the device is
/// lost, the function makes a new one. Any thread may call it. Throws vdi::Error{DeviceUnavailable}.
std::shared_ptr<vdi::gpu::Device> sharedDevice(int localRank);

}  // namespace pv

#endif
