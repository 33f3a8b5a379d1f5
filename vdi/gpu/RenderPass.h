// Dispatches render.comp: a VDI seen from a new viewpoint.
#pragma once

#include <cstdint>
#include <memory>

#include "shaders/shared/render.h"
#include "vdi/core/Reconstruction.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/ComputePipeline.h"

namespace vdi {
class View;
}

namespace vdi::gpu {

/// The part of RenderParams that follows from the two views; addresses and depth range are left 0.
shared::RenderParams renderGeometry(const View& original, const View& view);

class RenderPass {
 public:
  explicit RenderPass(std::shared_ptr<Device> device);
  void record(Commands& commands, const shared::RenderParams& params, Reconstruction reconstruction);

 private:
  PipelineSet pipelines_;  // by precision and reconstruction
};

}  // namespace vdi::gpu
