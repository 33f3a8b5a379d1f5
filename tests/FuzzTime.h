// Duration of a fuzzing test, and the seed of its first damage.
#pragma once

#include <chrono>
#include <cstdint>
#include <cstdlib>

namespace vdi::test {

/// A time limit that starts at its construction: VDI_FUZZ_SECONDS, or `usual` seconds if that isn't set.
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

/// The first number of a sequence of seeds: VDI_FUZZ_SEED, or 1. Sequences that begin elsewhere damage other
/// data, so that several processes can share a long run.
inline std::uint64_t fuzzSeed() {
  const char* const given = std::getenv("VDI_FUZZ_SEED");
  return given != nullptr ? std::strtoull(given, nullptr, 10) : 1;
}

}  // namespace vdi::test
