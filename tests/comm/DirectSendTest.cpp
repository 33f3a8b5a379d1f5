// Direct send: what is distributed, gathered and counted, on any number of ranks.
#include <algorithm>
#include <catch2/catch.hpp>
#include <functional>
#include <span>

#include "vdi/comm/DirectSend.h"
#include "vdi/core/Error.h"

using namespace vdi;
using comm::Communicator;

namespace {

/// Supersegment j of list i of a rank: every field says which.
Supersegment segmentOf(int rank, std::size_t list, std::uint32_t j) {
  const auto r = static_cast<float>(rank);
  const auto l = static_cast<float>(list);
  const auto n = static_cast<float>(j);
  return {n, n + 0.5F, r, l, -l, 1.0F / (r + 1.0F)};
}

/// 0 .. 6 supersegments a list; every third rank, from 1 on, has none at all.
std::uint32_t countOf(int rank, std::size_t list) {
  if (rank % 3 == 1) return 0;
  return static_cast<std::uint32_t>((list * 5 + static_cast<std::size_t>(rank) * 2) % 7);
}

SupersegmentLists listsOf(int rank, std::size_t first, std::size_t last) {
  SupersegmentLists lists;
  for (std::size_t i = first; i < last; ++i) {
    for (std::uint32_t j = 0; j < countOf(rank, i); ++j) lists.segments.push_back(segmentOf(rank, i, j));
    lists.offsets.push_back(static_cast<std::uint32_t>(lists.segments.size()));
  }
  return lists;
}

ErrorCode codeOf(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.code();
  }
  return ErrorCode::Cancelled;
}

}  // namespace

TEST_CASE("every rank receives its lists from every rank") {
  const Communicator world = Communicator::world();
  const std::size_t listCount =
      GENERATE(std::size_t{1}, std::size_t{2}, std::size_t{4}, std::size_t{13}, std::size_t{64} * 48);
  const comm::Received<Supersegment> received = comm::distribute(world, listsOf(world.rank(), 0, listCount));
  const comm::ListRange mine = comm::ownedLists(listCount, world.rank(), world.size());
  REQUIRE(received.subLists.size() == static_cast<std::size_t>(world.size()));
  std::uint64_t bytes = 0;
  for (int r = 0; r < world.size(); ++r) {
    const SupersegmentLists expected = listsOf(r, mine.first, mine.last);
    CHECK(received.subLists[static_cast<std::size_t>(r)] == expected);
    if (r != world.rank()) bytes += mine.count() * 4 + expected.segments.size() * sizeof(Supersegment);
  }
  CHECK(received.bytesReceived == bytes);
  std::vector<std::uint64_t> total{received.bytesSent, received.bytesReceived};
  world.allReduceSum(total);
  CHECK(total[0] == total[1]);  // what is sent arrives
}

TEST_CASE("what all ranks gather at any root is the whole, in order") {
  const Communicator world = Communicator::world();
  const std::size_t listCount = GENERATE(std::size_t{1}, std::size_t{3}, std::size_t{64} * 48);
  const comm::ListRange mine = comm::ownedLists(listCount, world.rank(), world.size());
  for (int root = 0; root < world.size(); ++root) {
    // Lists of one made-up rank, cut by owner: the root must get them back as they were.
    const SupersegmentLists whole = comm::gatherLists(world, listsOf(2, mine.first, mine.last), root);
    CHECK(whole == (world.rank() == root ? listsOf(2, 0, listCount) : SupersegmentLists()));
  }
}

TEST_CASE("ranks whose images differ in size are told, together") {
  const Communicator world = Communicator::world();
  const std::size_t listCount = world.rank() == world.size() - 1 ? 41 : 40;
  const ErrorCode code = codeOf([&] { comm::distribute(world, listsOf(world.rank(), 0, listCount)); });
  if (world.size() == 1) {
    CHECK(code == ErrorCode::Cancelled);
  } else {
    CHECK((code == ErrorCode::Communication || code == ErrorCode::RemoteRank));
  }
}

TEST_CASE("counts that don't match what comes with them are noticed") {
  const Communicator world = Communicator::world();
  if (world.size() == 1) return;
  constexpr std::size_t listCount = 40;
  const auto lists = listsOf(0, 0, listCount);
  const auto exchange = [&] {
    if (world.rank() != world.size() - 1) {
      comm::distribute(world, lists);
      return;
    }
    // The last rank does by hand what distribute does, but announces one supersegment more for each list.
    std::vector<std::uint64_t> listsTo;
    std::vector<std::uint64_t> segmentsTo;
    std::vector<std::uint32_t> counts;
    for (int r = 0; r < world.size(); ++r) {
      const comm::ListRange range = comm::ownedLists(listCount, r, world.size());
      listsTo.push_back(range.count());
      segmentsTo.push_back(lists.offsets[range.last] - lists.offsets[range.first]);
    }
    for (std::size_t i = 0; i < listCount; ++i) counts.push_back(lists.countOf(i) + 1);
    world.together([] {});
    world.allToAll(std::as_bytes(std::span(counts)), listsTo, sizeof(std::uint32_t));
    world.allToAll(std::as_bytes(std::span(lists.segments)), segmentsTo, sizeof(Supersegment));
    world.together([] {});
  };
  CHECK(codeOf(exchange) ==
        (world.rank() == world.size() - 1 ? ErrorCode::RemoteRank : ErrorCode::Communication));
}

TEST_CASE("a rank that hands in other lists than its own to gather makes all fail") {
  const Communicator world = Communicator::world();
  if (world.size() == 1) return;
  const comm::ListRange mine = comm::ownedLists(40, world.rank(), world.size());
  const std::size_t surplus = world.rank() == world.size() - 1 ? 2 : 0;
  const ErrorCode code =
      codeOf([&] { comm::gatherLists(world, listsOf(0, mine.first, mine.last + surplus), 0); });
  CHECK(code == (world.rank() == 0 ? ErrorCode::Communication : ErrorCode::RemoteRank));
}

TEST_CASE("the global scene is the union of what the ranks hold") {
  const Communicator world = Communicator::world();
  const int last = world.size() - 1;
  Scene local;  // rank 0 holds nothing, unless it's alone
  if (world.rank() > 0 || last == 0) {
    const double r = world.rank();
    local.bounds = {{r, -r, 5.0}, {r + 1.0, 1.0, 6.0 + r}};
    local.minSpacing = 0.5 / (r + 1.0);
  }
  const Scene scene = comm::globalScene(world, local);
  const double first = last == 0 ? 0.0 : 1.0;
  CHECK(scene.bounds == Box{{first, -1.0 * last, 5.0}, {last + 1.0, 1.0, 6.0 + last}});
  CHECK(scene.minSpacing == 0.5 / (last + 1.0));
  const Scene nothing = comm::globalScene(world, Scene());
  CHECK(nothing.bounds.empty());
  CHECK(nothing.minSpacing == 0.0);
}
