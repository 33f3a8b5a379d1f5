// Dispatches composite.comp: segments interleaved lists again to fit the budget.
#pragma once

#include <cstdint>
#include <memory>

#include "shaders/shared/composite.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/PipelineSet.h"

namespace vdi::gpu {

class CompositePass {
 public:
  explicit CompositePass(std::shared_ptr<Device> device);
  /// The purpose of a dispatch: the histogram of lists (merging), the algorithm's counting, or, after a scan,
  /// its writing.
  enum class Work { Histogram, Count, Write };
  void record(Commands& commands, const shared::CompositeParams& params, Work work, Algorithm algorithm);

 private:
  PipelineSet pipelines_;  // by shared::compositeProgram... and precision
};

}  // namespace vdi::gpu
