// Sums of bytes over all ranks, in memory that devices can import.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "vdi/comm/Exchange.h"

namespace vdi::comm {

/// Adds byte by byte, up to 255. Each rank sums its share of the bytes over all ranks, and all ranks get all
/// sums. Ranks of one host read the sums in place.
class ByteSum {
 public:
  /// Not collective. `comm` must outlive it.
  ByteSum(const Communicator& comm, Transport transport);

  /// Collective: returns the place for this rank's bytes. `bytes` is the same on all ranks.
  Exchange::Place begin(std::uint64_t bytes);
  /// A contiguous part of the sum.
  struct Stretch {
    Exchange::Place place;
    std::uint64_t first = 0;  // position among all bytes
    std::uint64_t bytes = 0;
  };
  /// Collective: returns the sum, as stretches that cover it. They stay valid until the next begin.
  std::span<const Stretch> add();

 private:
  struct Bytes {
    std::uint64_t first = 0;
    std::uint64_t count = 0;
  };
  Bytes shareOf(int rank) const;
  void addUp();

  const Communicator& comm_;
  Exchange scatter_;
  Exchange gather_;
  Exchange::Place own_;                     // this rank's bytes, replaced by sums
  std::vector<Exchange::Outgoing> pieces_;  // has memory for one piece to each rank
  std::vector<Stretch> stretches_;          // has memory for one stretch of each rank
  std::uint64_t bytes_ = 0;
};

}  // namespace vdi::comm
