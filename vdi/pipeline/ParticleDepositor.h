// Deposits the particles of all ranks on the cells of all ranks' blocks.
#pragma once

#include <memory>
#include <vector>

#include "vdi/comm/Communicator.h"
#include "vdi/core/Block.h"
#include "vdi/core/Particles.h"
#include "vdi/gpu/Device.h"

namespace vdi {

/// A rank's part of a deposit.
struct DepositedArray {
  /// One array for each of the rank's blocks: [dims.z][dims.y][dims.x], x fastest. Ghost cells have their
  /// owners' values. Cells that finer blocks hide have the mean of the finer values. A sum over a block
  /// counts both twice.
  std::vector<std::shared_ptr<float[]>> values;
  ParticleCounts counts;  // counts over all ranks
};

/// vdi/core/Particles.h has the rules of the deposit. A rank's particles may lie in any rank's blocks. The
/// result is that of one rank with all blocks and particles, to within rounding in single precision. It is
/// the same bit for bit when repeated. A contribution below 2^-55 of the total weight of all ranks may be
/// lost.
///
/// Memory: 8 bytes per stored cell on the device, and 4 on the host, which the result keeps. During
/// `deposit`, particles travel in parts that take some 500 MiB at most.
class ParticleDepositor {
 public:
  /// The communicator must outlive this object.
  ParticleDepositor(const std::shared_ptr<gpu::Device>& device, const comm::Communicator& comm);
  ~ParticleDepositor();
  ParticleDepositor(const ParticleDepositor&) = delete;
  ParticleDepositor& operator=(const ParticleDepositor&) = delete;

  /// Collective: sets this rank's blocks, which must be of cells. Their `data` aren't read, but tell blocks
  /// apart as in settleOwnership (comm/GhostExchange.h), which throws for the same overlaps. Where spacings
  /// differ, the finest block owns the place.
  void setBlocks(const std::vector<Block>& blocks);

  /// Collective. `kind` is the same on all ranks. Throws on all ranks: Error{OutOfMemory},
  /// Error{DeviceFailure}, and Error{InvalidArgument} for values beyond those of f32. After an error the
  /// next call starts again.
  DepositedArray deposit(const Particles& particles, DepositKind kind);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vdi
