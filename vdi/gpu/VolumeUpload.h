// Values of blocks to texels on the device.
#pragma once

#include <vulkan/vulkan.h>

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "vdi/core/Block.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/Memory.h"

namespace vdi::gpu {

class Device;

/// A box of a block's values that fits one page.
struct VolumePiece {
  const Block* block = nullptr;
  glm::ivec3 first{0};  // index of its first value in the block
  glm::uvec3 dims{0};
  VkFormat format = VK_FORMAT_UNDEFINED;
  std::uint32_t page = 0;
  glm::uvec3 place{0};      // in the page, texels
  double valueScale = 1.0;  // value = texel * valueScale + valueOffset
  double valueOffset = 0.0;
  bool samePlaceAs(const VolumePiece& other) const { return dims == other.dims && format == other.format; }
};

/// value = texel * scale + offset for the normalised formats and for f32.
struct ValueMap {
  double scale = 1.0;
  double offset = 0.0;
};
/// Of all other types: relative to the block's own range.
ValueMap valueMapOf(const Block& block);

/// Values that are texels as they are, the device copies from the block's own memory, where the driver can
/// import that (VK_EXT_external_memory_host). Others go through two staging buffers: one is filled while the
/// device copies from the other.
class VolumeUpload {
 public:
  explicit VolumeUpload(std::shared_ptr<Device> device);

  /// Fills the pages and makes them ready to be sampled; texels that no piece has are 0. Host data isn't
  /// needed afterwards.
  void run(std::span<const VolumePiece> pieces, std::span<const Image3D> pages);

 private:
  struct Half {
    explicit Half(const std::shared_ptr<Device>& device) : commands(device) {}
    Commands commands;
    Buffer staging;
    std::uint64_t filled = 0;
  };

  bool copyDirectly(const VolumePiece& piece, const Image3D& page, std::vector<Buffer>& imported);
  void stage(const VolumePiece& piece, const Image3D& page);
  Half& filling() { return halves_[current_]; }
  void turnOver();

  std::shared_ptr<Device> device_;
  std::array<Half, 2> halves_;
  std::size_t current_ = 0;
};

}  // namespace vdi::gpu
