// Who owns which list: arithmetic only.
#include <catch2/catch.hpp>
#include <cstdint>
#include <limits>

#include "vdi/comm/DirectSend.h"

using namespace vdi;

TEST_CASE("owned lists are contiguous, in rank order, complete, and differ by at most one") {
  const std::uint64_t lists =
      GENERATE(std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{2}, std::uint64_t{7}, std::uint64_t{8},
               std::uint64_t{9}, std::uint64_t{97}, std::uint64_t{1920} * 1080, std::uint64_t{65537},
               (std::uint64_t{1} << 32) + 1, std::uint64_t{32768} * 32768);
  const int size = GENERATE(1, 2, 3, 5, 8, 9, 36, 97, 1021);
  INFO(lists << " lists, " << size << " ranks");
  std::uint64_t next = 0;
  std::uint64_t least = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t most = 0;
  std::uint64_t previous = most;
  for (int rank = 0; rank < size; ++rank) {
    const comm::ListRange range = comm::ownedLists(lists, rank, size);
    CHECK(range.first == next);
    REQUIRE(range.last >= range.first);
    next = range.last;
    least = std::min(least, range.count());
    most = std::max(most, range.count());
    if (rank > 0) CHECK(range.count() <= previous);  // surplus ranks come last
    previous = range.count();
  }
  CHECK(next == lists);
  CHECK(most - least <= 1);
}

TEST_CASE("owned lists by hand") {
  CHECK(comm::ownedLists(10, 0, 3) == comm::ListRange{0, 4});
  CHECK(comm::ownedLists(10, 1, 3) == comm::ListRange{4, 7});
  CHECK(comm::ownedLists(10, 2, 3) == comm::ListRange{7, 10});
  CHECK(comm::ownedLists(2, 1, 5) == comm::ListRange{1, 2});
  CHECK(comm::ownedLists(2, 4, 5).count() == 0);
}
