// The assignment of lists to the ranks that composite them (paper, section 5.2), without communication.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace vdi::comm {

/// Lists [first, last) of one rank.
struct ListRange {
  std::uint64_t first = 0;
  std::uint64_t last = 0;
  std::uint64_t count() const { return last - first; }
  bool operator==(const ListRange&) const = default;
};

/// Divides lists into contiguous ranges: rank r owns range r. Ranges begin at multiples of `granularity`
/// lists.
class Ownership {
 public:
  /// Number of lists whose counts share one word.
  static constexpr std::uint64_t granularity = 4;

  /// Ranges of equal size, up to granularity; surplus ranks get empty ranges.
  static Ownership equal(std::uint64_t listCount, int ranks);
  /// Ranges of equal work, as far as contiguous ranges allow. `weights[i]` is the work in the i-th stretch of
  /// `listsPerWeight` lists (the last one may be shorter), spread evenly over it. Each list costs a little by
  /// itself, so that ranks share empty lists too. Equal arguments give equal results on every rank.
  static Ownership balanced(std::uint64_t listCount, int ranks, std::span<const std::uint32_t> weights,
                            std::uint64_t listsPerWeight);

  int ranks() const { return static_cast<int>(boundaries_.size()) - 1; }
  ListRange of(int rank) const {
    return {boundaries_[static_cast<std::size_t>(rank)], boundaries_[static_cast<std::size_t>(rank) + 1]};
  }
  bool operator==(const Ownership&) const = default;

 private:
  std::vector<std::uint64_t> boundaries_;  // rank i owns [boundaries_[i], boundaries_[i + 1])
};

}  // namespace vdi::comm
