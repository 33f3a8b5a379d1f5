// The particles that a simulation hands over.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "catalyst_adaptor/vdi_catalyst.h"
#include "vdi/core/Particles.h"

namespace vdi::catalyst {

/// Particles under a name, on the simulation's memory.
struct ParticleArray {
  Particles particles;
  DepositKind kind = DepositKind::Sum;
};

/// The values of cells that are made from particles: those of each block, x fastest.
using DepositedValues = std::vector<std::shared_ptr<float[]>>;

/// Throws std::invalid_argument with the reason if they are invalid.
ParticleArray particleArrayOf(const vdi_catalyst_particles* given);

/// A number for requireEqual: equal on two ranks if name, kind and periodic axes are.
std::int64_t identityOf(const char* name, const ParticleArray& array);

}  // namespace vdi::catalyst
