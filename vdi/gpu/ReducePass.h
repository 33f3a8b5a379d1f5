// Dispatches reduce.comp: grains merged into supersegments.
#pragma once

#include <memory>

#include "shaders/shared/reduce.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/ComputePipeline.h"

namespace vdi::gpu {

class ReducePass {
 public:
  explicit ReducePass(std::shared_ptr<Device> device);
  /// reduceModeCount, then (after a scan of the counts) reduceModeWrite.
  void record(Commands& commands, const shared::ReduceConstants& constants) const;

 private:
  ComputePipeline pipeline_;
};

}  // namespace vdi::gpu
