// The fields of Fields.h, computed by a device in seconds instead of minutes.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "vdi/gpu/Commands.h"
#include "vdi/gpu/Device.h"
#include "vdi/gpu/Memory.h"
#include "vdi/gpu/PipelineSet.h"
#include "vdi/synthetic/Decomposition.h"

namespace vdi::synthetic {

class DeviceField {
 public:
  /// Throws Error{InvalidArgument} that lists the valid names.
  DeviceField(std::shared_ptr<gpu::Device> device, const std::string& name, std::uint32_t seed);

  /// A part's values, `top` times the field's, of the lattice's type. They are deterministic on one device.
  /// Another device, and makeField, which works in double precision, may differ in the sixth digit. The
  /// lattice's spacing must be the same on all axes, its origin 0.
  std::shared_ptr<std::byte[]> makeValues(const Lattice& lattice, const Part& part, double top);
  /// Blocks for parts of `all`, a lattice of copies of `one` side by side; they share values.
  std::vector<Block> makeBlocks(const Lattice& one, const Lattice& all, std::span<const Part> parts,
                                double top);

 private:
  std::shared_ptr<gpu::Device> device_;
  gpu::ComputePipeline pipeline_;
  gpu::Commands commands_;
  gpu::Buffer values_;
  gpu::Buffer readback_;
  std::uint32_t field_;
  std::uint32_t seed_;
};

}  // namespace vdi::synthetic
