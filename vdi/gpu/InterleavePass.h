// Dispatches interleave.comp: puts the ranks' supersegments of each list in order of depth.
#pragma once

#include <memory>

#include "shaders/shared/composite.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/PipelineSet.h"

namespace vdi::gpu {

class InterleavePass {
 public:
  explicit InterleavePass(std::shared_ptr<Device> device);
  /// constants.mode is interleaveModeCount, then (after a scan) interleaveModeWrite, then
  /// interleaveModeFlatten for a picture.
  void record(Commands& commands, const shared::InterleaveConstants& constants);

 private:
  PipelineSet pipelines_;  // by precision
};

}  // namespace vdi::gpu
