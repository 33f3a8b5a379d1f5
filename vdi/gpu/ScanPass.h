// Dispatches scan.comp: the prefix sum that says where each list starts in the compact array (paper, section
// 4).
#pragma once

#include <cstdint>
#include <memory>

#include "vdi/gpu/Commands.h"
#include "vdi/gpu/ComputePipeline.h"
#include "vdi/gpu/Memory.h"

namespace vdi::gpu {

class ScanPass {
 public:
  explicit ScanPass(std::shared_ptr<Device> device);

  /// prefix[0 .. count] = exclusive prefix sum of values[0 .. count - 1], prefix[count] being the total.
  /// Records its barriers, also one at the start and one at the end. Nothing that was recorded before may be
  /// running.
  void record(Commands& commands, const Buffer& values, const Buffer& prefix, std::uint32_t count);

  /// Adds `base` to prefix[0 .. count]. Barriers as record.
  void recordRebase(Commands& commands, const Buffer& prefix, std::uint32_t count, std::uint32_t base) const;

  /// Throws Error{OutOfMemory} if the total of the last finished scan didn't fit 32 bits.
  void demandNoOverflow() const;

 private:
  std::shared_ptr<Device> device_;
  ComputePipeline pipeline_;
  Buffer sums_;  // of workgroups
  Buffer overflow_;
};

}  // namespace vdi::gpu
