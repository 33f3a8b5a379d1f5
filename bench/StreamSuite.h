// The suite `stream` of `vdi bench`: VDIs on their way from a simulation or a folder to a viewer.
#pragma once

#include <cstdio>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "bench/Suites.h"
#include "vdi/comm/Communicator.h"
#include "vdi/gpu/Device.h"

namespace vdi::bench {

/// Checks the options before the work starts. Throws Error.
void requireSoundStream(const BenchOptions& options);

/// Returns one row for each data set, N_S, rate and way of a frame, and writes its line to `table`
/// at once. Server and viewer are threads of the root's process, connected by a socket. Collective
/// over `world`; the root gets the rows. Throws Error.
std::vector<nlohmann::json> runStream(const BenchOptions& options, const comm::Communicator& world,
                                      const std::shared_ptr<gpu::Device>& device, std::FILE* table);

}  // namespace vdi::bench
