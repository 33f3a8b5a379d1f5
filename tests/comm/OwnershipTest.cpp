// Ownership of lists, for any number of ranks. There is no communication.
#include <algorithm>
#include <random>
#include <vector>

#include "tests/Catch.h"
#include "vdi/comm/Ownership.h"

using vdi::comm::ListRange;
using vdi::comm::Ownership;

namespace {

void checkCovers(const Ownership& ownership, std::uint64_t lists, int ranks) {
  REQUIRE(ownership.ranks() == ranks);
  std::uint64_t next = 0;
  for (int r = 0; r < ranks; ++r) {
    const ListRange range = ownership.of(r);
    REQUIRE(range.first == next);
    REQUIRE(range.last >= range.first);
    if (range.last < lists) REQUIRE(range.last % Ownership::granularity == 0);
    next = range.last;
  }
  REQUIRE(next == lists);
}

}  // namespace

TEST_CASE("every list has one owner, in rank order") {
  for (const std::uint64_t lists : {1ULL, 2ULL, 7ULL, 64ULL * 48, 1920ULL * 1080}) {
    for (const int ranks : {1, 2, 3, 5, 16, 61, 127, 1000, 1024}) {
      INFO(lists << " lists, " << ranks << " ranks");
      const Ownership equal = Ownership::equal(lists, ranks);
      checkCovers(equal, lists, ranks);
      std::uint64_t maximum = 0;
      for (int r = 0; r < ranks; ++r) maximum = std::max(maximum, equal.of(r).count());
      CHECK(maximum <= lists / static_cast<std::uint64_t>(ranks) + 2 * Ownership::granularity);
      std::mt19937 random(7);
      std::vector<std::uint32_t> weights((lists + 99) / 100);
      for (std::uint32_t& weight : weights)
        weight = random() % 3 == 0 ? static_cast<std::uint32_t>(random() % 5000) : 0;
      checkCovers(Ownership::balanced(lists, ranks, weights, 100), lists, ranks);
    }
  }
}

TEST_CASE("shares are equal if they fit") {
  CHECK(Ownership::equal(24, 3).of(1) == ListRange{8, 16});
  CHECK(Ownership::equal(10, 3).of(2) == ListRange{8, 10});
  CHECK(Ownership::equal(2, 5).of(0) == ListRange{0, 2});
  CHECK(Ownership::equal(2, 5).of(4).count() == 0);
}

TEST_CASE("all ranks share material in one corner of a picture") {
  constexpr std::uint64_t width = 400;
  constexpr std::uint64_t height = 400;
  // 20 supersegments per list in the lowest tenth of the rows.
  std::vector<std::uint32_t> weights(height / 4, 0);
  for (std::size_t i = 0; i < weights.size() / 10; ++i) weights[i] = 4 * width * 20;
  constexpr int ranks = 16;
  const Ownership ownership = Ownership::balanced(width * height, ranks, weights, 4 * width);
  std::uint64_t maximum = 0;
  std::uint64_t total = 0;
  for (int r = 0; r < ranks; ++r) {
    const ListRange range = ownership.of(r);
    const std::uint64_t full =
        std::min(range.last, width * height / 10) - std::min(range.first, width * height / 10);
    const std::uint64_t work = full * 20 + range.count();
    maximum = std::max(maximum, work);
    total += work;
  }
  CHECK(maximum * ranks < total * 11 / 10);
}
