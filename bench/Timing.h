// Measures repeated runs on a GPU with a raised clock.
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <vector>

#include "vdi/gpu/Commands.h"
#include "vdi/gpu/Device.h"
#include "vdi/gpu/Memory.h"

namespace vdi::bench {

struct Spread {
  double median = 0.0;
  double minimum = 0.0;
  double maximum = 0.0;
  double width() const { return maximum - minimum; }
};
/// Requires at least one value.
Spread spreadOf(std::vector<double> values);

/// The spread of the milliseconds that `measure` returns, after a warm-up run.
template <typename Measure>
Spread repeated(int repeats, Measure measure) {
  measure();
  std::vector<double> times(static_cast<std::size_t>(repeats));
  for (double& time : times) time = measure();
  return spreadOf(times);
}

/// The duration of `work()` in milliseconds.
template <typename Work>
double wallMs(Work work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

/// Gives the GPU work before a measured run. A GPU lowers its clock to a fifth while the host
/// works, and takes a second or two to raise it again. Does nothing on a CPU.
class ClockRaiser {
 public:
  explicit ClockRaiser(const std::shared_ptr<gpu::Device>& device);
  void run();

 private:
  using Clock = std::chrono::steady_clock;
  gpu::Commands commands_;
  gpu::Buffer buffer_;
  Clock::time_point lastRun_;
};

}  // namespace vdi::bench
