// Dispatches merge.comp: the ranks' sub-supersegments of each list in order of depth.
#pragma once

#include <memory>

#include "shaders/shared/composite.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/PipelineSet.h"

namespace vdi::gpu {

class MergePass {
 public:
  explicit MergePass(std::shared_ptr<Device> device);
  /// constants.mode: mergeModeCount, then (after a scan) mergeModeMerge, then mergeModeFlatten for a picture.
  void record(Commands& commands, const shared::MergeConstants& constants);

 private:
  PipelineSet pipelines_;  // by precision
};

}  // namespace vdi::gpu
