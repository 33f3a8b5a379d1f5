// Dispatches render.comp: a VDI seen from a new viewpoint.
#pragma once

#include <cstdint>
#include <memory>

#include "shaders/shared/render.h"
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
  /// `params` is the address of a RenderParams; width and height are the picture's.
  void record(Commands& commands, VkDeviceAddress params, std::uint32_t width, std::uint32_t height) const;

 private:
  ComputePipeline pipeline_;
};

}  // namespace vdi::gpu
