// Uploads blocks' values to texels on the device.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "vdi/gpu/Commands.h"
#include "vdi/gpu/Memory.h"
#include "vdi/gpu/VolumePages.h"

namespace vdi::gpu {

/// Runs on the device's transfer queue, through two staging buffers: all cores fill one while the device
/// copies from the other. If values can be texels as they are and the driver can import host memory
/// (VK_EXT_external_memory_host), a process with one core lets the device copy them from the block's own
/// memory instead. Values of patches are inserted among the staged ones, or copied after the block's own
/// values.
class VolumeUpload {
 public:
  explicit VolumeUpload(std::shared_ptr<Device> device);

  /// Call before each run: its copies wait on the device for the last submission of `before`.
  void begin(const Commands& before);
  /// Copies the pieces to their places in the pages, which stay ready to be sampled. Returns when all values
  /// are copied; host data is not needed afterwards. Any thread may call it while others use the device.
  void run(std::span<const VolumePiece> pieces, std::span<const SampledImage> pages);
  /// The commands that run submitted last, for other queues to wait for.
  const Commands& last() const { return halves_[current_].commands; }

 private:
  struct Half {
    explicit Half(const std::shared_ptr<Device>& device) : commands(device, QueueKind::Transfer) {}
    Commands commands;
    Buffer staging;
    std::uint64_t filled = 0;
  };

  bool copyDirectly(const VolumePiece& piece, const SampledImage& page, std::vector<Buffer>& imported);
  void stage(const VolumePiece& piece, const IndexBox& values, const SampledImage& page);
  Half& filling() { return halves_[current_]; }
  void turnOver();

  std::shared_ptr<Device> device_;
  std::array<Half, 2> halves_;
  std::size_t current_ = 0;
};

}  // namespace vdi::gpu
