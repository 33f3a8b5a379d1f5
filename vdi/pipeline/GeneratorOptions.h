// How a VdiGenerator works. No option changes a VDI.
#pragma once

#include <cstdint>

#include "vdi/comm/Communicator.h"
#include "vdi/comm/Transport.h"

namespace vdi {

/// Equal on all ranks.
struct GeneratorOptions {
  comm::Transport transport = comm::Transport::Shared;
  std::uint32_t bands = 0;  // in which a frame is made, if memory allows; 0: one on a GPU, eight on a CPU
};

/// Collective. The options that rank 0's environment sets (VDI_TRANSPORT, VDI_BANDS), on all ranks; mpirun
/// may not pass an environment on. Throws Error{InvalidArgument} on all ranks for values that make no sense.
GeneratorOptions generatorOptionsFromEnvironment(const comm::Communicator& comm);

}  // namespace vdi
