#include "vdi/pipeline/HistogramBuffer.h"

#include "shaders/shared/lists.h"

namespace vdi::detail {

static_assert(gpu::shared::histogramLevels == SupersegmentHistogram::levels);

namespace {

constexpr std::uint64_t bytes = (SupersegmentHistogram::levels + 1) * 2 * sizeof(std::uint32_t);

}  // namespace

HistogramBuffer::HistogramBuffer(std::shared_ptr<gpu::Device> device)
    : sums_(device, bytes, gpu::MemoryKind::DeviceLocal),
      readback_(std::move(device), bytes, gpu::MemoryKind::Readback) {}

SupersegmentHistogram HistogramBuffer::take(gpu::Commands& commands, const Record& record) {
  commands.begin();
  commands.fill(sums_, 0);
  commands.barrier();
  commands.mark("histogram");
  record(commands, sums_.address());
  commands.barrier();
  commands.mark("download");
  commands.copy(sums_, 0, readback_, 0, bytes);
  commands.submitAndWait();
  const auto words = readback_.mappedAs<std::uint32_t>();
  const auto sum = [&](std::size_t i) { return words[2 * i] | std::uint64_t{words[2 * i + 1]} << 32U; };
  SupersegmentHistogram histogram;
  for (std::size_t level = 0; level < SupersegmentHistogram::levels; ++level)
    histogram.supersegments[level] = sum(level);
  histogram.equally = sum(SupersegmentHistogram::levels);
  return histogram;
}

}  // namespace vdi::detail
