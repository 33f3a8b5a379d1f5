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
  void record(Commands& commands, const shared::ReduceConstants& constants);

 private:
  PipelineSet pipelines_;  // by precision
};

}  // namespace vdi::gpu
