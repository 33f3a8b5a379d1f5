// Dispatches composite.comp: merged lists segmented again, to the budget.
#pragma once

#include <cstdint>
#include <memory>

#include "shaders/shared/composite.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/ComputePipeline.h"

namespace vdi::gpu {

class CompositePass {
 public:
  explicit CompositePass(std::shared_ptr<Device> device);
  /// `params` is the address of a CompositeParams of that form. The first step of the algorithm, then
  /// (`write`, after a scan) the second one.
  void record(Commands& commands, VkDeviceAddress params, const shared::StoredForm& form, Algorithm algorithm,
              bool write, std::uint32_t listCount);

 private:
  PipelineSet pipelines_;  // by shared::compositeProgram... and precision
};

}  // namespace vdi::gpu
