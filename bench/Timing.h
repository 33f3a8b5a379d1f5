// Times of repeated runs, on a GPU whose clock is up.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
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
/// Of one value or more.
Spread spreadOf(std::vector<double> values);

/// Of the milliseconds that `measure` returns, after a run that doesn't count.
template <typename Measure>
Spread repeated(int repeats, Measure measure) {
  measure();
  std::vector<double> times(static_cast<std::size_t>(repeats));
  for (double& time : times) time = measure();
  return spreadOf(times);
}

/// How long `work()` takes, in milliseconds.
template <typename Work>
double wallMs(Work work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

/// A GPU lowers its clock while the host works, to a fifth of what it has when it's busy, and takes a second
/// or two to raise it again: gives it something to do before a run that counts. Nothing on a CPU.
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
