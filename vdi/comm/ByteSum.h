// Sums of bytes over all ranks, in memory that devices can import.
#pragma once

#include <cstdint>
#include <vector>

#include "vdi/comm/Exchange.h"
#include "vdi/comm/Schedule.h"

namespace vdi::comm {

/// Byte by byte, 255 at most. In the schedule's rounds ranks add up what they keep, until each has the sum of
/// its share; then the rounds go backwards, and all get all shares. Between ranks of one host nothing is
/// copied in the last of them.
class ByteSum {
 public:
  /// Not collective. `comm` must stay.
  ByteSum(const Communicator& comm, Transport transport, const Schedule& schedule);

  /// Collective: where this rank is to put its bytes, the same number on all ranks.
  Exchange::Place begin(std::uint64_t bytes);
  /// A stretch of the sum.
  struct Stretch {
    Exchange::Place place;
    std::uint64_t first = 0;  // of all bytes
    std::uint64_t bytes = 0;
  };
  /// Collective: the sum, as stretches that cover it. They stay until the next begin.
  std::vector<Stretch> add();

 private:
  struct Bytes {
    std::uint64_t first = 0;
    std::uint64_t count = 0;
  };
  Bytes bytesOf(const Schedule::Shares& shares) const;
  void addUp(const Schedule::Round& round);
  std::vector<Exchange::Incoming> sendBack(const Schedule::Round& round);

  const Communicator& comm_;
  std::vector<Schedule::Round> rounds_;  // this rank's
  Exchange scatter_;
  Exchange gather_;
  Exchange::Place own_;  // this rank's bytes, which become sums
  Exchange::Place sums_;
  Bytes held_;  // of all bytes, those in sums_
  std::uint64_t bytes_ = 0;
};

}  // namespace vdi::comm
