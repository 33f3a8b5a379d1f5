// Dispatches scan.comp: the prefix sum that says where each list starts in the compact array (paper, section
// 4).
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "shaders/shared/scan.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/Memory.h"
#include "vdi/gpu/PipelineSet.h"

namespace vdi::gpu {

class ScanPass {
 public:
  explicit ScanPass(std::shared_ptr<Device> device);

  /// prefix[0 .. count] = exclusive prefix sum of values[0 .. count - 1], prefix[count] being the total.
  /// Records its barriers, also one at the start and one at the end. Nothing that was recorded before may be
  /// running.
  void record(Commands& commands, const Buffer& values, const Buffer& prefix, std::uint32_t count);
  /// The same, and whether the total fits: `guard` (a word) becomes 1 if it's `room` at most, and, if it's
  /// given, the word `before` is 1; else 0. What's dispatched next can look at it, and do nothing, before the
  /// host has seen the total.
  void record(Commands& commands, const Buffer& values, const Buffer& prefix, std::uint32_t count,
              const Buffer& guard, std::uint64_t room, const Buffer* before = nullptr);

  /// Adds `base` to prefix[first .. first + count - 1]. Barriers as record.
  void recordRebase(Commands& commands, const Buffer& prefix, std::uint64_t first, std::uint32_t count,
                    std::uint32_t base);

  /// Throws Error{OutOfMemory} if the total of the last finished scan didn't fit 32 bits.
  void requireNoOverflow() const;

 private:
  void recordBoth(Commands& commands, shared::ScanConstants constants, ComputePipeline& pipeline);

  std::shared_ptr<Device> device_;
  PipelineSet pipelines_;  // without guard, with one, with one that looks at another one
  Buffer sums_;            // of workgroups
  /// Those that were too small for a later scan: what was recorded before may still use them. They're a few,
  /// and small, for each is half as large again as the one before.
  std::vector<Buffer> outgrown_;
  Buffer overflow_;
};

}  // namespace vdi::gpu
