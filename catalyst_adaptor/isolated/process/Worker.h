// The worker, which makes the frames of one rank of the simulation in a process of its own.
#pragma once

#include "catalyst_adaptor/isolated/Socket.h"

namespace vdi::catalyst {

/// Carries out the run that `setup`'s pages describe with the steps that come through the socket. Starts MPI
/// and ends it. Returns the program's exit status. Throws std::runtime_error if the pages are damaged.
int work(Socket socket, Descriptor setup);

}  // namespace vdi::catalyst
