// The destination of a VDI's lists while it is made: the root's memory (HostSinks.h), a file (FileSink.h), a
// renderer (VdiRenderer.cpp). A new destination is another class of this kind. Not part of the library's
// interface.
#pragma once

#include <cstdint>
#include <functional>

#include "vdi/core/Vdi.h"
#include "vdi/gpu/Commands.h"
#include "vdi/pipeline/DeviceLists.h"
#include "vdi/pipeline/Reports.h"

namespace vdi::detail {

/// The calls come in this order: begin, add for each band, finish. After an error in any of them, or in the
/// making of a band, fail replaces the rest. All functions except record and fail are collective: with
/// several ranks, each has a sink of its own.
class VdiSink {
 public:
  VdiSink() = default;
  virtual ~VdiSink() = default;
  VdiSink(const VdiSink&) = delete;
  VdiSink& operator=(const VdiSink&) = delete;
  VdiSink(VdiSink&&) = delete;
  VdiSink& operator=(VdiSink&&) = delete;

  /// `header` is the VDI without its lists. It stays until finish or fail.
  virtual void begin(const Vdi& header) = 0;

  /// Only with one rank: records commands after those that make a band. `firstList` is the position of the
  /// band's first list in the VDI.
  virtual void record(gpu::Commands& /*commands*/, const DeviceLists& /*lists*/,
                      std::uint64_t /*firstList*/) {}

  /// Lists that this rank owns, on its device. With several ranks, they stay until finish.
  struct Band {
    const DeviceLists& lists;
    std::uint64_t firstList = 0;
    bool last = false;
  };
  using Wait = std::function<void()>;
  /// Bands come in their order. `wait` returns when the band is made; it may throw, so call it in
  /// Communicator::together. Returns the submission that uses the band's memory last, if any. The device
  /// makes the next band meanwhile. Adds its times to `report`.
  virtual gpu::Submission add(const Band& band, const Wait& wait, RankReport& report) = 0;

  /// Returns when the VDI is at its destination, or when the device's queued work will bring it there.
  virtual void finish(RankReport& report) = 0;

  /// Drops the lists added so far.
  virtual void fail() noexcept {}
};

}  // namespace vdi::detail
