// From intervals to compact lists on the device, band by band: search, prefix sum, write, download (paper,
// section 4). What casts rays and what composites share it; not part of the library's interface.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "vdi/core/Vdi.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/Device.h"
#include "vdi/gpu/Memory.h"
#include "vdi/gpu/ScanPass.h"

namespace vdi::detail {

/// Device addresses of one band of lists, counted from the band's first list.
struct BandTargets {
  std::uint64_t sensitivities = 0;
  std::uint64_t counts = 0;
  std::uint64_t offsets = 0;
  std::uint64_t segments = 0;
  std::uint64_t status = 0;
};

class ListBuilder {
 public:
  explicit ListBuilder(std::shared_ptr<gpu::Device> device);

  /// Records the dispatch that fills sensitivities and counts, or (write) segments.
  using Record = std::function<void(gpu::Commands&, const BandTargets&, bool write)>;

  /// Runs both steps for `listCount` lists and appends what was written to `result`. Throws
  /// Error{OutOfMemory} when the supersegments don't fit, Error{DeviceFailure} if a list's written count
  /// isn't its stored count.
  void build(std::uint32_t listCount, const Record& record, SupersegmentLists& result);

 private:
  std::shared_ptr<gpu::Device> device_;
  gpu::Commands commands_;
  gpu::ScanPass scan_;
  gpu::Buffer sensitivities_;
  gpu::Buffer counts_;
  gpu::Buffer offsets_;
  gpu::Buffer segments_;
  gpu::Buffer status_;
  gpu::Buffer readback_;
};

}  // namespace vdi::detail
