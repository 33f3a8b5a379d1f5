// Values of blocks to texels on the device.
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

/// Runs on the device's transfer queue, through two staging buffers: one is filled, by all cores, while the
/// device copies from the other. A process with one core rather lets the device copy values that are texels
/// as they are from the block's own memory, where the driver can import that (VK_EXT_external_memory_host).
/// Values of patches are put among the staged ones, or copied once the block's own are there.
class VolumeUpload {
 public:
  explicit VolumeUpload(std::shared_ptr<Device> device);

  /// What run copies waits on the device for what `before` submitted last. Before each run.
  void begin(const Commands& before);
  /// Copies the pieces to their places in the pages, which stay ready to be sampled. Returns when all is
  /// there and host data isn't needed any more. May be called by any thread, while others use the device.
  void run(std::span<const VolumePiece> pieces, std::span<const SampledImage> pages);
  /// What run submitted last: to be waited for by other queues.
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
