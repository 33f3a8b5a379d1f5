#include "vdi/comm/Ownership.h"

#include <algorithm>
#include <cassert>

namespace vdi::comm {

Ownership Ownership::equal(std::uint64_t listCount, int ranks) {
  assert(ranks >= 1);
  const auto size = static_cast<std::uint64_t>(ranks);
  Ownership ownership;
  const std::uint64_t words = (listCount + granularity - 1) / granularity;
  for (std::uint64_t r = 0; r <= size; ++r) {
    const std::uint64_t word = r * (words / size) + std::min(r, words % size);
    ownership.boundaries_.push_back(std::min(word * granularity, listCount));
  }
  return ownership;
}

Ownership Ownership::balanced(std::uint64_t listCount, int ranks, std::span<const std::uint32_t> weights,
                              std::uint64_t listsPerWeight) {
  assert(ranks >= 1 && listsPerWeight >= 1 && weights.size() * listsPerWeight >= listCount);
  const auto size = static_cast<std::uint64_t>(ranks);
  // The work of a stretch: its weight, plus one supersegment for each list.
  const auto workOf = [&](std::size_t i) {
    const std::uint64_t first = i * listsPerWeight;
    return weights[i] + std::min(listsPerWeight, listCount - std::min(first, listCount));
  };
  std::uint64_t total = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) total += workOf(i);

  Ownership ownership;
  ownership.boundaries_.push_back(0);
  std::uint64_t before = 0;  // work of stretches [0, i)
  std::size_t i = 0;
  for (std::uint64_t r = 1; r < size; ++r) {
    // Integer arithmetic gives the same result on all machines; a total beyond 2^64 / ranks would need more
    // lists than can exist.
    const std::uint64_t wanted = total / size * r + total % size * r / size;
    while (i < weights.size() && before + workOf(i) <= wanted) before += workOf(i++);
    std::uint64_t boundary = std::min(i * listsPerWeight, listCount);
    if (i < weights.size()) {
      const std::uint64_t lists = std::min(listsPerWeight, listCount - boundary);
      boundary += (wanted - before) * lists / std::max<std::uint64_t>(workOf(i), 1);
    }
    boundary = boundary / granularity * granularity;
    ownership.boundaries_.push_back(std::max(boundary, ownership.boundaries_.back()));
  }
  ownership.boundaries_.push_back(listCount);
  return ownership;
}

}  // namespace vdi::comm
