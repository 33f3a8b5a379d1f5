// The particles that a simulation hands over.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "catalyst_adaptor/HostCopy.h"
#include "catalyst_adaptor/vdi_catalyst.h"
#include "vdi/core/Particles.h"

namespace vdi::catalyst {

/// Particles under a name, on the simulation's memory, or on a copy of what lies in a GPU's memory.
struct ParticleArray {
  Particles particles;
  DepositKind kind = DepositKind::Sum;
  std::shared_ptr<HostCopy> copy;  // null: all numbers lie on the host
  std::uint64_t fetched = 0;       // the step in which the numbers were made readable
};

/// The columns that particles have, in a fixed order.
std::vector<NumberColumn*> columnsOf(Particles& particles);

/// The values of cells that are made from particles: those of each block, x fastest.
using DepositedValues = std::vector<std::shared_ptr<float[]>>;

/// Throws std::invalid_argument with the reason if they are invalid. `copy` is null.
ParticleArray particleArrayOf(const vdi_catalyst_particles* given);

/// A number for requireEqual: equal on two ranks if name, kind and periodic axes are.
std::int64_t identityOf(const char* name, const ParticleArray& array);

}  // namespace vdi::catalyst
