// Sums of bytes over all ranks, in memory that devices can import.
#pragma once

#include <cstdint>
#include <vector>

#include "vdi/comm/Exchange.h"

namespace vdi::comm {

/// Byte by byte, 255 at most. Each rank adds up one stretch of what all have; then all get all stretches.
/// Between ranks of one host nothing is copied for that.
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
  Stretch stretchOf(int rank) const;

  const Communicator& comm_;
  Exchange scatter_;
  Exchange gather_;
  Exchange::Place own_;
  std::uint64_t bytes_ = 0;
};

}  // namespace vdi::comm
