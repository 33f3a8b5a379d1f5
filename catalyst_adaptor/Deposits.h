// The cell arrays that the engines make from a simulation's particles.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "catalyst_adaptor/Fields.h"
#include "vdi/comm/Communicator.h"
#include "vdi/gpu/Device.h"
#include "vdi/pipeline/ParticleDepositor.h"

namespace vdi::catalyst {

/// Deposits particles on a run's blocks.
class Deposits {
 public:
  /// The device and the communicator must outlive this object.
  Deposits(const std::shared_ptr<gpu::Device>& device, const comm::Communicator& comm)
      : comm_(comm), depositor_(device, comm) {}

  /// Collective: makes the array of the particles of that name, which `fields` has, and keeps it there.
  /// Throws on all ranks, as ParticleDepositor does. The report of particles that are left out names `step`.
  void make(Fields& fields, const std::string& name, std::int64_t step);
  /// Takes over another object's record of reported faults.
  void continueTelling(const Deposits& other) { told_ = other.told_; }

 private:
  void setBlocks(const Fields& fields);
  void tell(const std::string& name, const ParticleCounts& counts, std::int64_t step);

  const comm::Communicator& comm_;
  ParticleDepositor depositor_;
  std::optional<std::uint64_t> version_;
  std::map<std::string, unsigned> told_;  // by name: a bit for each reported kind of fault
};

/// Deposits particles on a device of its own, which the first deposit opens.
class DeviceDeposits {
 public:
  /// Collective: duplicates the communicator.
  explicit DeviceDeposits(int fortranCommunicator);

  /// Collective: makes the arrays of all particles, and keeps them in `fields`. Throws on all ranks as
  /// Deposits does, and Error{DeviceUnavailable}. If the device was lost, it opens another one.
  void make(Fields& fields, std::int64_t step);

 private:
  void open();
  void make(Fields& fields, const std::string& name, std::int64_t step);

  comm::Communicator comm_;
  std::shared_ptr<gpu::Device> device_;
  std::unique_ptr<Deposits> deposits_;
};

}  // namespace vdi::catalyst
