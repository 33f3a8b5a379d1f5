// Dispatches long_lists.comp, reduce_subgroup.comp, reduce.comp and store.comp: merges pre-segments and
// stores them as supersegments.
#pragma once

#include <memory>

#include "shaders/shared/reduce.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/ComputePipeline.h"
#include "vdi/gpu/Memory.h"
#include "vdi/gpu/PipelineSet.h"

namespace vdi::gpu {

class ReducePass {
 public:
  /// Yes: a subgroup merges each list that fits its memory. No: a single invocation merges each list.
  enum class Subgroups { Yes, No };

  /// The default is Yes if the device has DeviceLimits::subgroupSize and runs programs for GPUs.
  explicit ReducePass(const std::shared_ptr<Device>& device);
  ReducePass(std::shared_ptr<Device> device, Subgroups subgroups);

  struct MaxPerList {
    std::uint32_t supersegments = 1;
    bool always = true;  // false: lists may have more where gaps require it
  };

  /// Sets longLists, longListCount and subgroupCapacity of `constants`.
  void record(Commands& commands, shared::ReduceConstants constants, const MaxPerList& maxPerList);

 private:
  void recordSubgroups(Commands& commands, shared::ReduceConstants& constants);

  std::shared_ptr<Device> device_;
  Subgroups subgroups_;
  ComputePipeline find_;
  PipelineSet subgroup_;  // by capacity
  ComputePipeline alone_;
  PipelineSet store_;  // by precision, and whether lists may fit the budget as they are
  Buffer longLists_;
  Buffer longListCount_;
};

}  // namespace vdi::gpu
