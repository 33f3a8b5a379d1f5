#include "vdi/pipeline/Distributor.h"

#include <algorithm>

namespace vdi::detail {

using gpu::MemoryKind;
namespace shared = gpu::shared;

namespace {

static_assert(comm::Ownership::granularity == shared::countsPerWord);

/// Supersegments begin at a multiple of that, as shaders want them.
constexpr std::uint64_t segmentAlignment = 64;

std::uint64_t aligned(std::uint64_t bytes) {
  return (bytes + segmentAlignment - 1) / segmentAlignment * segmentAlignment;
}

std::uint64_t packedBytes(std::uint64_t lists, bool wide) {
  return wide ? lists * wordBytes : (lists + shared::countsPerWord - 1) / shared::countsPerWord * wordBytes;
}

/// Of all the counts, those from a list on that begins a word.
std::uint64_t packedAt(std::uint64_t list, bool wide) {
  return wide ? list * wordBytes : list / shared::countsPerWord * wordBytes;
}

}  // namespace

HostAccess& HostAccesses::of(const std::shared_ptr<HostMemory>& memory) {
  std::unique_ptr<HostAccess>& access = accesses_[memory.get()];
  if (!access) access = std::make_unique<HostAccess>(device_, memory);
  return *access;
}

void HostAccesses::tidy() {
  std::erase_if(accesses_, [](const auto& entry) { return entry.second->memory().use_count() == 1; });
}

Distributor::Distributor(std::shared_ptr<gpu::Device> device, const comm::Communicator& comm,
                         comm::Transport transport)
    : device_(std::move(device)),
      comm_(comm),
      exchange_(comm, transport),
      accesses_(device_),
      commands_(device_),
      transfers_(device_, gpu::QueueKind::Transfer),
      counts_(device_),
      tooLarge_(device_, wordBytes, MemoryKind::Readback) {}

void Distributor::recordCounts(gpu::Commands& commands, const DeviceLists& lists, bool wide) {
  const std::uint64_t bytes = packedBytes(lists.listCount, wide);
  packed_.reserve(device_, bytes, MemoryKind::DeviceLocal);
  shared::CountsConstants constants{};
  constants.offsets = lists.offsets.address();
  constants.packed = packed_.address();
  constants.tooLarge = tooLarge_.address();
  constants.listCount = lists.listCount;
  constants.words = static_cast<std::uint32_t>(bytes / wordBytes);
  constants.mode = wide ? shared::countsModePackWide : shared::countsModePack;
  counts_.record(commands, constants);
}

/// All lists' counts to packed_, and where each rank's supersegments begin to boundaryOffsets_.
void Distributor::recordPack(gpu::Commands& commands, const DeviceLists& lists,
                             const comm::Ownership& owned) {
  const auto ranks = static_cast<std::uint64_t>(owned.ranks());
  boundaryOffsets_.reserve(device_, (ranks + 1) * wordBytes, MemoryKind::Readback);
  tooLarge_.mappedAs<std::uint32_t>()[0] = 0;
  recordCounts(commands, lists, false);
  for (std::uint64_t r = 0; r <= ranks; ++r) {
    const std::uint64_t list = r < ranks ? owned.of(static_cast<int>(r)).first : lists.listCount;
    commands.copy(lists.offsets, list * wordBytes, boundaryOffsets_, r * wordBytes, wordBytes);
  }
}

/// Where a count has no room in a byte: all of them as words.
void Distributor::packWide(const DeviceLists& lists) {
  commands_.begin();
  recordCounts(commands_, lists, true);
  commands_.submitAndWait();
}

Distributed Distributor::distribute(const DeviceLists& lists, const comm::Ownership& owned,
                                    std::uint64_t segmentBytes) {
  const int ranks = owned.ranks();
  bytesSent_ = 0;
  // What each rank gets of this one's, and where that lies in the outbox.
  std::vector<comm::Exchange::Outgoing> pieces;
  std::uint64_t outboxBytes = 0;
  const auto firstSegment = [&](int rank) {
    return std::uint64_t{boundaryOffsets_.mappedAs<std::uint32_t>()[static_cast<std::size_t>(rank)]};
  };
  const auto segmentsOf = [&](int rank) { return firstSegment(rank + 1) - firstSegment(rank); };
  wide_ = tooLarge_.mappedAs<std::uint32_t>()[0] != 0;
  for (int r = 0; r < ranks; ++r) {
    if (r == comm_.rank() || segmentsOf(r) == 0) continue;
    comm::Exchange::Outgoing piece;
    piece.to = r;
    piece.at = outboxBytes;
    piece.bytes = aligned(packedBytes(owned.of(r).count(), wide_)) + segmentsOf(r) * segmentBytes;
    piece.note = {segmentsOf(r), wide_ ? 1U : 0U};
    outboxBytes += aligned(piece.bytes);
    bytesSent_ += piece.bytes;
    pieces.push_back(piece);
  }
  const comm::Exchange::Place outbox = exchange_.outbox(outboxBytes);
  comm_.together([&] {
    accesses_.tidy();
    if (wide_) packWide(lists);
    if (pieces.empty()) return;
    HostAccess& access = accesses_.of(outbox.memory);
    transfers_.begin();
    transfers_.waitFor(lists.written);
    if (wide_) transfers_.waitFor(commands_);
    for (const comm::Exchange::Outgoing& piece : pieces) {
      const comm::ListRange range = owned.of(piece.to);
      const std::uint64_t at = outbox.at + piece.at;
      const std::uint64_t countBytes = packedBytes(range.count(), wide_);
      access.recordWrite(transfers_, packed_, packedAt(range.first, wide_), at, countBytes);
      access.recordWrite(transfers_, lists.segments, firstSegment(piece.to) * segmentBytes,
                         at + aligned(countBytes), segmentsOf(piece.to) * segmentBytes);
    }
    transfers_.submitAndWait();
    access.finish();
  });
  const std::vector<comm::Exchange::Incoming> incoming = exchange_.send(pieces);

  Distributed result;
  const comm::ListRange mine = owned.of(comm_.rank());
  result.ownCounts = &packed_;
  result.ownSegments = &lists.segments;
  result.ownWritten = wide_ ? commands_.last() : lists.written;
  result.listCount = static_cast<std::uint32_t>(mine.count());
  result.segmentBytes = segmentBytes;
  const auto addOwn = [&] {
    if (segmentsOf(comm_.rank()) == 0) return;
    result.subLists.push_back({nullptr, packedAt(mine.first, wide_), wide_,
                               firstSegment(comm_.rank()) * segmentBytes, segmentsOf(comm_.rank())});
  };
  comm_.together([&] {
    bool ownAdded = false;
    for (const comm::Exchange::Incoming& piece : incoming) {
      if (!ownAdded && piece.from > comm_.rank()) {
        addOwn();
        ownAdded = true;
      }
      const bool wide = piece.note[1] != 0;
      result.subLists.push_back({&accesses_.of(piece.place.memory), piece.place.at, wide,
                                 piece.place.at + aligned(packedBytes(mine.count(), wide)), piece.note[0]});
    }
    if (!ownAdded) addOwn();
  });
  for (const SubLists& sub : result.subLists) result.total += sub.count;
  return result;
}

}  // namespace vdi::detail
