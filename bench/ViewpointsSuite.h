// The suite `viewpoints` of `vdi bench`: the accuracy of VDIs from viewpoints all around the scene.
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
void requireSoundViewpoints(const BenchOptions& options);

/// Returns one row for each data set, zoom, kind of viewpoints, N_S and margin, and writes its line
/// to `table` at once. Collective over `world`; the root gets the rows. Throws Error.
std::vector<nlohmann::json> runViewpoints(const BenchOptions& options, const comm::Communicator& world,
                                          const std::shared_ptr<gpu::Device>& device, std::FILE* table);

}  // namespace vdi::bench
