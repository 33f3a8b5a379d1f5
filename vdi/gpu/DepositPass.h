// Dispatches deposit.comp: spreads particles over the cells of blocks.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "shaders/shared/deposit.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/ComputePipeline.h"
#include "vdi/gpu/Memory.h"

namespace vdi::gpu {

/// The sums of a rank's blocks, 8 bytes per cell on the device. Sums wrap around beyond 63 bits.
class DepositPass {
 public:
  explicit DepositPass(std::shared_ptr<Device> device);

  /// Sets the sums of blocks with that many cells per axis to 0. Throws Error{OutOfMemory}.
  void start(std::span<const glm::ivec3> blocks);
  /// Adds particles, whose `block` fields index start's blocks. Returns after copying them; the next call
  /// waits for the device.
  void add(std::span<const shared::DepositParticle> particles);
  /// Calls use(block, first cell, sums) for parts of all blocks' sums, in order.
  template <typename Use>
  void finish(Use use);
  /// Frees the sums' memory.
  void release();

 private:
  std::span<const std::int64_t> download(std::size_t block, std::uint64_t first, std::uint64_t count);

  static constexpr std::uint64_t atOnce = std::uint64_t{1} << 22;  // cells downloaded at a time, 32 MiB
  std::shared_ptr<Device> device_;
  ComputePipeline pipeline_;
  std::vector<std::uint64_t> cells_;  // number of cells of each block
  std::vector<std::uint64_t> first_;  // first cell of each block, in sums_
  Buffer sums_;
  Buffer blocks_;
  Buffer particles_;
  Buffer readback_;
  Commands commands_;  // last: its destructor waits for the device, which uses the memory
};

template <typename Use>
void DepositPass::finish(Use use) {
  for (std::size_t block = 0; block < cells_.size(); ++block) {
    for (std::uint64_t first = 0; first < cells_[block]; first += atOnce) {
      const std::uint64_t count = std::min(atOnce, cells_[block] - first);
      use(block, first, download(block, first, count));
    }
  }
}

}  // namespace vdi::gpu
