// Dispatches queue.comp, reduce_team.comp, reduce.comp and store.comp: grains merged, and stored as
// supersegments.
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
  /// Whether a team merges a list, where it has room for that, or a single invocation.
  enum class Teams { Yes, No };

  /// Teams: where the device has DeviceLimits::subgroupSize and runs programs for GPUs.
  explicit ReducePass(const std::shared_ptr<Device>& device);
  ReducePass(std::shared_ptr<Device> device, Teams teams);

  struct MostPerList {
    std::uint32_t supersegments = 1;
    bool always = true;  // or more, where gaps demand that
  };

  /// `constants` without queue, queued and teamCapacity.
  void record(Commands& commands, shared::ReduceConstants constants, const MostPerList& most);

 private:
  void recordTeams(Commands& commands, shared::ReduceConstants& constants);

  std::shared_ptr<Device> device_;
  Teams teams_;
  ComputePipeline find_;
  PipelineSet team_;  // by capacity
  ComputePipeline alone_;
  PipelineSet store_;  // by precision, and whether lists may fit
  Buffer queue_;
  Buffer queued_;
};

}  // namespace vdi::gpu
