// How long a fuzzing test goes on.
#pragma once

#include <chrono>
#include <cstdlib>

namespace vdi::test {

/// VDI_FUZZ_SECONDS from its construction on, or `usual` seconds if that isn't set.
class FuzzTime {
 public:
  explicit FuzzTime(double usual) {
    const char* const given = std::getenv("VDI_FUZZ_SECONDS");
    const std::chrono::duration<double> time(given != nullptr ? std::strtod(given, nullptr) : usual);
    end_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(time);
  }
  bool isOver() const { return Clock::now() >= end_; }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point end_;
};

}  // namespace vdi::test
