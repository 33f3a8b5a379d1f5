// The suite `ranks` of `vdi bench`: whole frames on 1, 2, 4 ... of the ranks that mpirun started.
#pragma once

#include <cstdio>
#include <glm/glm.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "bench/Suites.h"
#include "vdi/comm/Communicator.h"
#include "vdi/gpu/Device.h"

namespace vdi::bench {

/// The factors by which one rank's volume grows on each axis to serve all `ranks`. Their product is
/// `ranks`, and the whole volume is as close to a cube as the prime factors allow.
glm::ivec3 growthFor(int ranks, const glm::ivec3& sizePerRank);

/// Checks the options before the work starts. Throws Error.
void requireSoundRanks(const BenchOptions& options, int ranks);

/// Returns one row for each volume, scaling, layout, rank count and N_S, and writes its line to
/// `table` at once. Collective over `world`, which has all ranks of MPI_COMM_WORLD. Ranks beyond
/// the measured count sleep. The root gets the rows. Throws Error.
std::vector<nlohmann::json> runRanks(const BenchOptions& options, const comm::Communicator& world,
                                     const std::shared_ptr<gpu::Device>& device, std::FILE* table);

}  // namespace vdi::bench
