#include "vdi/pipeline/GatheredLists.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "vdi/core/Error.h"

namespace vdi::detail {

namespace {

constexpr std::size_t offsetsArray = 0;
constexpr std::size_t segmentsArray = 1;

}  // namespace

template <typename Segment>
GatheredLists<Segment>::GatheredLists(const comm::Communicator& comm, int root,
                                      std::shared_ptr<HostPool> pool, Gather& gather, DownloadMemory& memory,
                                      std::uint64_t listCount)
    : comm_(comm),
      root_(root),
      pool_(std::move(pool)),
      gather_(gather),
      memory_(memory),
      listCount_(listCount) {}

template <typename Segment>
void GatheredLists<Segment>::begin(std::uint64_t expected) {
  comm_.together([&] {
    if (!isRoot()) return;
    lists_ = listsIn<Segment>(pool_);
    lists_.offsets.resize(listCount_ + 1);
    lists_.segments.reserve(std::max<std::uint64_t>(expected, 1));
  });
  const std::span segments(lists_.segments.data(), lists_.segments.capacity());
  gather_.begin(*pool_, std::array{std::as_writable_bytes(std::span(lists_.offsets)),
                                   std::as_writable_bytes(segments)});
  room_ = gather_.room(segmentsArray) / sizeof(Segment);
}

template <typename Segment>
void GatheredLists<Segment>::send(const DeviceLists& lists, std::uint64_t firstList,
                                  std::span<const std::uint64_t> counts, bool last) {
  Sent sent{&lists, firstList, total_};
  for (std::size_t r = 0; r < counts.size(); ++r) {
    if (r == static_cast<std::size_t>(comm_.rank())) sent.firstSegment = total_;
    total_ += counts[r];
  }
  sent_.push_back(sent);
  if (!fits()) return;
  sendSegments(sent);
  if (last) sendOffsets();
}

template <typename Segment>
void GatheredLists<Segment>::sendSegments(const Sent& sent) {
  const DeviceLists& lists = *sent.lists;
  const Gather::Piece piece{&lists.segments, segmentsArray, sent.firstSegment * sizeof(Segment),
                            lists.count * sizeof(Segment)};
  gather_.send(std::span(&piece, 1), lists.written);
}

/// Sends this rank's offsets, counted from the picture's first supersegment.
template <typename Segment>
void GatheredLists<Segment>::sendOffsets() {
  std::vector<Gather::Piece> pieces;
  memory_.commands.begin();
  for (const Sent& sent : sent_) {
    const DeviceLists& lists = *sent.lists;
    memory_.scan.recordRebase(memory_.commands, lists.offsets, 0, lists.listCount,
                              static_cast<std::uint32_t>(sent.firstSegment));
    pieces.push_back({&lists.offsets, offsetsArray, sent.firstList * sizeof(std::uint32_t),
                      lists.listCount * sizeof(std::uint32_t)});
  }
  memory_.commands.submit();
  gather_.send(pieces, memory_.commands.last());
}

template <typename Segment>
ListsOf<Segment> GatheredLists<Segment>::finish() {
  const bool again = !fits();
  comm_.together([&] {
    if (total_ > std::numeric_limits<std::uint32_t>::max())
      throw Error(ErrorCode::OutOfMemory, "more than 2^32 supersegments in one VDI");
    if (again) gather_.drop();
  });
  if (again) {
    begin(total_ + total_ / 8);
    comm_.together([&] {
      for (const Sent& sent : sent_) sendSegments(sent);
      sendOffsets();
    });
  }
  gather_.finish();
  if (isRoot()) {
    lists_.segments.resize(total_);  // within what `begin` has reserved
    lists_.offsets[listCount_] = static_cast<std::uint32_t>(total_);
  }
  return std::move(lists_);
}

#define VDI_GATHERED_LISTS(Segment) template class GatheredLists<Segment>;
VDI_EACH_ENCODING(VDI_GATHERED_LISTS)
#undef VDI_GATHERED_LISTS

}  // namespace vdi::detail
