// Dispatches scan.comp: the prefix sum that gives each list's start in the compact array (paper, section 4).
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

  /// Computes prefix[0 .. count]: the exclusive prefix sum of values[0 .. count - 1], with the total at
  /// prefix[count]. Records its barriers, including one at the start and one at the end. No earlier dispatch
  /// of this pass may be running.
  void record(Commands& commands, const Buffer& values, const Buffer& prefix, std::uint32_t count);
  /// Also records whether the total fits: `guard` (a word) becomes 1 if the total is at most `room` and the
  /// word `before`, if given, is 1; else 0. Later dispatches are skipped on the device if it is 0, before
  /// the host knows the total.
  void record(Commands& commands, const Buffer& values, const Buffer& prefix, std::uint32_t count,
              const Buffer& guard, std::uint64_t room, const Buffer* before = nullptr);

  /// Adds `base` to prefix[first .. first + count - 1]. Has the same barriers as record.
  void recordRebase(Commands& commands, const Buffer& prefix, std::uint64_t first, std::uint32_t count,
                    std::uint32_t base);

  /// Throws Error{OutOfMemory} if the total of the last finished scan didn't fit into 32 bits.
  void requireNoOverflow() const;

 private:
  void recordBoth(Commands& commands, shared::ScanConstants constants, ComputePipeline& pipeline);

  std::shared_ptr<Device> device_;
  PipelineSet pipelines_;  // without guard, with one, and with one that depends on another
  Buffer sums_;            // sums of workgroups
  /// Buffers that were too small for a later scan, kept because recorded commands may use them. They are few
  /// and small, since each is 1.5 times as large as the previous one.
  std::vector<Buffer> outgrown_;
  Buffer overflow_;
};

}  // namespace vdi::gpu
