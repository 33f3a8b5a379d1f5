// Dispatches expand.comp: supersegments as they're stored to what rendering wants.
#pragma once

#include <memory>

#include "shaders/shared/render.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/PipelineSet.h"

namespace vdi::gpu {

class ExpandPass {
 public:
  explicit ExpandPass(std::shared_ptr<Device> device);
  /// One of the expandMode's: all segments first, in any number of parts; then the masks; then the tiles.
  void record(Commands& commands, const shared::ExpandConstants& constants);

 private:
  PipelineSet pipelines_;  // by precision
};

/// Small and large tiles.
std::uint64_t tileCount(const glm::ivec2& lists);

}  // namespace vdi::gpu
