// Makes the frames of a rank of the simulation, in the process that is there for them.
#pragma once

#include "catalyst_adaptor/isolated/Socket.h"

namespace vdi::catalyst {

/// Carries out the run that `setup`'s pages describe with the steps that come through the socket. Starts MPI
/// and ends it. Returns the program's exit status. Throws std::runtime_error if the pages are damaged.
int work(Socket socket, Descriptor setup);

}  // namespace vdi::catalyst
