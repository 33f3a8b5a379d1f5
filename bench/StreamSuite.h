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

/// Checks everything that is known before the work starts. Throws Error.
void requireSoundStream(const BenchOptions& options);

/// Returns one row for each data set, N_S, rate and way of a frame; writes a line to `table` as soon as each
/// is known. Server and viewer are threads of the root's process, joined by a socket. Collective over
/// `world`; the root gets the rows. Throws Error.
std::vector<nlohmann::json> runStream(const BenchOptions& options, const comm::Communicator& world,
                                      const std::shared_ptr<gpu::Device>& device, std::FILE* table);

}  // namespace vdi::bench
