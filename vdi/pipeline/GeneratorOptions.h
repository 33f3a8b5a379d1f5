// Options for the way a VdiGenerator works. No option changes a VDI.
#pragma once

#include <cstdint>

#include "vdi/comm/Communicator.h"
#include "vdi/comm/Transport.h"

namespace vdi {

/// Must be equal on all ranks.
struct GeneratorOptions {
  comm::Transport transport = comm::Transport::Shared;
  std::uint32_t bands = 0;  // per frame, if memory allows; 0: one on a GPU, eight on a CPU
};

/// Collective. The options from rank 0's environment (VDI_TRANSPORT, VDI_BANDS), on all ranks, because mpirun
/// may not pass an environment on. Throws Error{InvalidArgument} on all ranks for invalid values.
GeneratorOptions generatorOptionsFromEnvironment(const comm::Communicator& comm);

}  // namespace vdi
