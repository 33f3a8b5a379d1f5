#include "bench/Timing.h"

#include <algorithm>

namespace vdi::bench {

Spread spreadOf(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  const double middle = values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
  return {middle, values.front(), values.back()};
}

ClockRaiser::ClockRaiser(const std::shared_ptr<gpu::Device>& device) : commands_(device) {
  constexpr std::uint64_t bytes = std::uint64_t{256} << 20;
  if (!device->isCpu()) buffer_ = gpu::Buffer(device, bytes, gpu::MemoryKind::DeviceLocal);
}

void ClockRaiser::run() {
  if (!buffer_) return;
  using std::chrono::milliseconds;
  const bool low = Clock::now() - lastRun_ > milliseconds(1000);
  const auto enough = Clock::now() + (low ? milliseconds(2500) : milliseconds(30));
  while (Clock::now() < enough) {
    constexpr int fills = 16;  // a millisecond on a fast GPU
    commands_.begin();
    for (int i = 0; i < fills; ++i) commands_.fill(buffer_, 0);
    commands_.submitAndWait();
  }
  lastRun_ = Clock::now();
}

}  // namespace vdi::bench
