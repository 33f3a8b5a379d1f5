// What the filters of one process share: the Vulkan device, volumes on it, and the communicator behind a VTK
// controller.
#ifndef VDISession_h
#define VDISession_h

#include <memory>
#include <string>

#include "vdi/comm/Communicator.h"
#include "vdi/gpu/Device.h"

class vtkMultiProcessController;

namespace pv {

class Volumes;

/// A communicator over the controller's MPI communicator (a duplicate: collective), or over this process
/// alone when there's none.
vdi::comm::Communicator communicatorOf(vtkMultiProcessController* controller);

/// Whether this process is a server's: what it makes is shown in another one.
bool isServer();

/// To be called on all ranks before a collective operation: throws vdi::Error{RemoteRank} where another rank
/// won't enter (VDICollective.h).
void enterCollective(vtkMultiProcessController* controller, const std::string& operation);
/// Whether a simulation's adaptor watches over such operations.
bool isWatched(vtkMultiProcessController* controller);

/// The process's device, made at the first call and kept while anybody holds it. Where that is lost, a new
/// one. From any thread. Throws vdi::Error{DeviceUnavailable}.
std::shared_ptr<vdi::gpu::Device> sharedDevice(int localRank);

/// The process's volumes, kept while anybody holds it. From any thread.
std::shared_ptr<Volumes> sharedVolumes();

}  // namespace pv

#endif
