// Dispatches interpolate.comp: list tolerances, interpolated from those of the counted lists.
#pragma once

#include <memory>

#include "shaders/shared/interpolate.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/PipelineSet.h"

namespace vdi::gpu {

class InterpolatePass {
 public:
  explicit InterpolatePass(std::shared_ptr<Device> device);
  void record(Commands& commands, const shared::InterpolateConstants& constants);

 private:
  PipelineSet pipelines_;  // for one rank, and for one of several ranks
};

}  // namespace vdi::gpu
