// Dispatches cull.comp and render.comp: renders a VDI from a new viewpoint.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "shaders/shared/render.h"
#include "vdi/core/Reconstruction.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/Memory.h"
#include "vdi/gpu/PipelineSet.h"

namespace vdi {
class View;
}

namespace vdi::gpu {

/// RenderParams::pixelSize.
float pixelSizeOf(const View& original);
/// The part of RenderParams that follows from the two views; addresses and depth range are left 0.
shared::RenderParams renderGeometry(const View& original, const View& view);
shared::RenderRays renderRays(const View& original, const View& view);

class RenderPass {
 public:
  explicit RenderPass(const std::shared_ptr<Device>& device);
  /// Call after a barrier. Sets the queue of `params`. `form` is one of shared::renderPicture....
  void record(Commands& commands, shared::RenderParams params, const shared::RenderRays& rays,
              Reconstruction reconstruction, std::uint32_t form);
  /// Compiles the pipeline that most views need. Any thread may call it during the other calls.
  void compile(Reconstruction reconstruction, std::uint32_t form) const;

 private:
  std::vector<std::uint32_t> specialization(const shared::RenderParams& params,
                                            const shared::RenderRays& rays, Reconstruction reconstruction,
                                            std::uint32_t form) const;

  std::shared_ptr<Device> device_;
  std::uint32_t lanesPerRay_;
  PipelineSet cull_;
  PipelineSet render_;
  Buffer queue_;
  Buffer waiting_;
};

}  // namespace vdi::gpu
