// Dispatches composite.comp: merged lists segmented again, to the budget.
#pragma once

#include <cstdint>
#include <memory>

#include "shaders/shared/composite.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/ComputePipeline.h"

namespace vdi::gpu {

class CompositePass {
 public:
  explicit CompositePass(std::shared_ptr<Device> device);
  /// `params` is the address of a CompositeParams; mode compositeModeSearch, then (after a scan)
  /// compositeModeWrite.
  void record(Commands& commands, VkDeviceAddress params, std::uint32_t mode, std::uint32_t listCount) const;

 private:
  ComputePipeline pipeline_;
};

}  // namespace vdi::gpu
