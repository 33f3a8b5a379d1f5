// The suite `ranks` of `vdi bench`: whole frames on 1, 2, 4 ... of the ranks that mpirun started.
#pragma once

#include <cstdio>
#include <glm/glm.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/Suites.h"
#include "vdi/comm/Communicator.h"
#include "vdi/gpu/Device.h"

namespace vdi::bench {

/// What one rank's volume is multiplied by on each axis so that there is one for each of `ranks`: the product
/// is `ranks`, and the whole is as near to a cube as its prime factors allow.
glm::ivec3 growthFor(int ranks, const glm::ivec3& sizePerRank);

/// What can be known before anything takes time. Throws Error.
void requireSoundRanks(const BenchOptions& options, int ranks);

/// One row for each volume, scaling, layout, rank count and N_S; writes a line of `table` as soon as each is
/// known. Collective over `world`, which has all ranks of MPI_COMM_WORLD: those beyond the count that is
/// measured sleep. The root gets the rows. Throws Error.
std::vector<nlohmann::json> runRanks(const BenchOptions& options, const comm::Communicator& world,
                                     const std::shared_ptr<gpu::Device>& device, std::FILE* table);

}  // namespace vdi::bench
