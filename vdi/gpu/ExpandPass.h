// Dispatches expand.comp: converts stored supersegments to the form for rendering.
#pragma once

#include <memory>

#include "shaders/shared/render.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/PipelineSet.h"

namespace vdi::gpu {

class ExpandPass {
 public:
  explicit ExpandPass(std::shared_ptr<Device> device);
  /// constants.mode is one of expandMode...: first all segments, in any number of parts; then the masks; then
  /// the tiles.
  void record(Commands& commands, const shared::ExpandConstants& constants);

 private:
  PipelineSet pipelines_;  // by precision
};

/// Number of small and large tiles together.
std::uint64_t tileCount(const glm::ivec2& lists);

}  // namespace vdi::gpu
