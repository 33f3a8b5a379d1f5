// Sums of bytes over all ranks, in memory that devices can import.
#pragma once

#include <cstdint>
#include <vector>

#include "vdi/comm/Exchange.h"

namespace vdi::comm {

/// Byte by byte, 255 at most. Each rank adds up one share of the bytes, of all ranks, and all ranks get all
/// sums. Ranks of one host read the sums where they were added up.
class ByteSum {
 public:
  /// Not collective. `comm` must stay.
  ByteSum(const Communicator& comm, Transport transport);

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
  Bytes shareOf(int rank) const;
  void addUp();

  const Communicator& comm_;
  Exchange scatter_;
  Exchange gather_;
  Exchange::Place own_;  // this rank's bytes, which become sums
  std::uint64_t bytes_ = 0;
};

}  // namespace vdi::comm
