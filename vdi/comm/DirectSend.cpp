#include "vdi/comm/DirectSend.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>
#include <limits>
#include <span>

#include "vdi/core/Error.h"

namespace vdi::comm {

namespace {

template <typename T>
std::vector<T> copyAs(std::span<const std::byte> bytes) {
  std::vector<T> values(bytes.size() / sizeof(T));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size() * sizeof(T));
  return values;
}

/// Lists from their counts and supersegments. Throws Error{Communication} when they don't match,
/// Error{OutOfMemory} when the 32-bit offsets can't count them.
template <typename Segment>
ListsOf<Segment> assemble(std::span<const std::uint32_t> counts, std::vector<Segment> segments) {
  if (segments.size() > std::numeric_limits<std::uint32_t>::max()) {
    throw Error(ErrorCode::OutOfMemory, "more than 2^32 - 1 supersegments in one VDI");
  }
  ListsOf<Segment> lists;
  lists.offsets.reserve(counts.size() + 1);
  std::uint64_t total = 0;
  for (const std::uint32_t count : counts) {
    total += count;
    lists.offsets.push_back(static_cast<std::uint32_t>(total));
  }
  if (total != segments.size()) {
    throw Error(ErrorCode::Communication, "the counts received don't match the supersegments received");
  }
  lists.segments = std::move(segments);
  return lists;
}

template <typename Segment>
std::vector<std::uint32_t> countsOf(const ListsOf<Segment>& lists) {
  std::vector<std::uint32_t> counts(lists.listCount());
  for (std::size_t i = 0; i < counts.size(); ++i) counts[i] = lists.countOf(i);
  return counts;
}

/// Throws Error{Communication} unless every rank sent counts for just the lists that it owns.
void demandOwnedLists(const Gathered& counts) {
  const auto size = static_cast<int>(counts.offsets.size()) - 1;
  const std::uint64_t total = counts.bytes.size() / sizeof(std::uint32_t);
  for (int r = 0; r < size; ++r) {
    const std::uint64_t sent = counts.of(r).size() / sizeof(std::uint32_t);
    const std::uint64_t owned = ownedLists(total, r, size).count();
    if (sent != owned) {
      throw Error(ErrorCode::Communication,
                  fmt::format("rank {} sent {} of {} lists, its part is {}", r, sent, total, owned));
    }
  }
}

}  // namespace

ListRange ownedLists(std::uint64_t listCount, int rank, int size) {
  assert(size >= 1 && rank >= 0 && rank < size);
  const auto ranks = static_cast<std::uint64_t>(size);
  const auto mine = static_cast<std::uint64_t>(rank);
  const std::uint64_t share = listCount / ranks;
  const std::uint64_t rest = listCount % ranks;
  const std::uint64_t first = mine * share + std::min(mine, rest);
  return {first, first + share + (mine < rest ? 1 : 0)};
}

template <typename Segment>
Received<Segment> distribute(const Communicator& comm, const ListsOf<Segment>& sub) {
  assert(sub.offsets.back() == sub.segments.size());
  const auto ranks = static_cast<std::size_t>(comm.size());
  const auto me = static_cast<std::size_t>(comm.rank());
  std::vector<std::uint64_t> listsTo(ranks);
  std::vector<std::uint64_t> segmentsTo(ranks);
  std::vector<std::uint32_t> counts;
  comm.together([&] {
    counts = countsOf(sub);
    for (std::size_t r = 0; r < ranks; ++r) {
      const ListRange range = ownedLists(sub.listCount(), static_cast<int>(r), comm.size());
      listsTo[r] = range.count();
      segmentsTo[r] = sub.offsets[range.last] - sub.offsets[range.first];
    }
  });
  const Gathered receivedCounts =
      comm.allToAll(std::as_bytes(std::span(counts)), listsTo, sizeof(std::uint32_t));
  const Gathered receivedSegments =
      comm.allToAll(std::as_bytes(std::span(sub.segments)), segmentsTo, sizeof(Segment));

  Received<Segment> received;
  comm.together([&] {
    for (std::size_t r = 0; r < ranks; ++r) {
      const auto part = copyAs<std::uint32_t>(receivedCounts.of(static_cast<int>(r)));
      if (part.size() != listsTo[me]) {
        throw Error(ErrorCode::Communication, "the ranks' sub-VDIs have different numbers of lists");
      }
      received.subLists.push_back(assemble(part, copyAs<Segment>(receivedSegments.of(static_cast<int>(r)))));
      if (r == me) continue;
      received.bytesSent += listsTo[r] * sizeof(std::uint32_t) + segmentsTo[r] * sizeof(Segment);
      received.bytesReceived +=
          receivedCounts.of(static_cast<int>(r)).size() + receivedSegments.of(static_cast<int>(r)).size();
    }
  });
  return received;
}

template <typename Segment>
ListsOf<Segment> gatherLists(const Communicator& comm, const ListsOf<Segment>& owned, int root) {
  assert(owned.offsets.back() == owned.segments.size());
  std::vector<std::uint32_t> counts;
  comm.together([&] { counts = countsOf(owned); });
  const Gathered allCounts = comm.gather(std::as_bytes(std::span(counts)), sizeof(std::uint32_t), root);
  const Gathered allSegments = comm.gather(std::as_bytes(std::span(owned.segments)), sizeof(Segment), root);
  ListsOf<Segment> lists;
  comm.together([&] {
    if (comm.rank() == root) {
      demandOwnedLists(allCounts);
      lists = assemble(copyAs<std::uint32_t>(allCounts.bytes), copyAs<Segment>(allSegments.bytes));
    }
  });
  return lists;
}

template Received<Supersegment> distribute(const Communicator&, const SupersegmentLists&);
template Received<CompactSupersegment> distribute(const Communicator&, const CompactLists&);
template SupersegmentLists gatherLists(const Communicator&, const SupersegmentLists&, int);
template CompactLists gatherLists(const Communicator&, const CompactLists&, int);

Scene globalScene(const Communicator& comm, const Scene& local) {
  std::array<double, 7> least{
      local.bounds.lo.x,
      local.bounds.lo.y,
      local.bounds.lo.z,
      -local.bounds.hi.x,
      -local.bounds.hi.y,
      -local.bounds.hi.z,
      local.minSpacing > 0.0 ? local.minSpacing : std::numeric_limits<double>::infinity()};
  comm.allReduceMin(least);
  Scene scene;
  scene.bounds.lo = {least[0], least[1], least[2]};
  scene.bounds.hi = {-least[3], -least[4], -least[5]};
  scene.minSpacing = least[6] < std::numeric_limits<double>::infinity() ? least[6] : 0.0;
  return scene;
}

}  // namespace vdi::comm
