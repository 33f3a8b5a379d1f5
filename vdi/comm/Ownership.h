// Who composites which lists (paper, section 5.2). Pure arithmetic: no communication.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace vdi::comm {

/// Lists [first, last) belong to one rank.
struct ListRange {
  std::uint64_t first = 0;
  std::uint64_t last = 0;
  std::uint64_t count() const { return last - first; }
  bool operator==(const ListRange&) const = default;
};

/// Contiguous ranges of lists, the shares: rank r owns share r. They begin at multiples of `granularity`
/// lists.
class Ownership {
 public:
  /// Lists whose counts travel in one word.
  static constexpr std::uint64_t granularity = 4;

  /// As many lists in each, but for granularity; none in surplus shares.
  static Ownership equal(std::uint64_t listCount, int ranks);
  /// As much work in each, as far as contiguous ranges allow. `weights[i]`: work in the i-th stretch of
  /// `listsPerWeight` lists (the last one may be shorter), spread evenly over it. A list is some work of its
  /// own, so that ranks share what's empty too. Every rank that passes the same gets the same.
  static Ownership balanced(std::uint64_t listCount, int ranks, std::span<const std::uint32_t> weights,
                            std::uint64_t listsPerWeight);

  int ranks() const { return static_cast<int>(boundaries_.size()) - 1; }
  ListRange of(int rank) const {
    return {boundaries_[static_cast<std::size_t>(rank)], boundaries_[static_cast<std::size_t>(rank) + 1]};
  }
  bool operator==(const Ownership&) const = default;

 private:
  std::vector<std::uint64_t> boundaries_;  // share i is [boundaries_[i], boundaries_[i + 1])
};

}  // namespace vdi::comm
