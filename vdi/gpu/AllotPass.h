// Dispatches allot.comp: what lists may take, from those that were counted.
#pragma once

#include <memory>

#include "shaders/shared/allot.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/PipelineSet.h"

namespace vdi::gpu {

class AllotPass {
 public:
  explicit AllotPass(std::shared_ptr<Device> device);
  void record(Commands& commands, const shared::AllotConstants& constants);

 private:
  PipelineSet pipelines_;  // for one rank, and for one of several
};

}  // namespace vdi::gpu
