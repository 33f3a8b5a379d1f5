// Dispatches counts.comp: packs lists' counts for exchange between ranks.
#pragma once

#include <memory>

#include "shaders/shared/counts.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/ComputePipeline.h"

namespace vdi::gpu {

class CountsPass {
 public:
  explicit CountsPass(std::shared_ptr<Device> device);
  void record(Commands& commands, const shared::CountsConstants& constants) const;

 private:
  ComputePipeline pipeline_;
};

}  // namespace vdi::gpu
