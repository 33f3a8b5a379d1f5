// Device memory in which shaders add up a histogram of lists. Not part of the library's interface.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "vdi/core/Budget.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/Memory.h"

namespace vdi::detail {

class HistogramBuffer {
 public:
  explicit HistogramBuffer(std::shared_ptr<gpu::Device> device);

  /// Records a dispatch that adds to the histogram at this device address ([histogramLevels + 1][2] words).
  using Record = std::function<void(gpu::Commands&, std::uint64_t address)>;
  /// Runs the dispatch and returns its histogram.
  SupersegmentHistogram take(gpu::Commands& commands, const Record& record);

 private:
  gpu::Buffer sums_;
  gpu::Buffer readback_;
};

}  // namespace vdi::detail
