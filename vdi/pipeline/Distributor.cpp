#include "vdi/pipeline/Distributor.h"

#include <algorithm>

#include "shaders/shared/counts.h"

namespace vdi::detail {

using gpu::MemoryKind;
namespace shared = gpu::shared;

namespace {

static_assert(comm::Ownership::granularity == shared::countsPerWord);

/// Supersegments begin at a multiple of this, as shaders require.
constexpr std::uint64_t segmentAlignment = 64;

std::uint64_t aligned(std::uint64_t bytes) {
  return (bytes + segmentAlignment - 1) / segmentAlignment * segmentAlignment;
}

std::uint64_t packedBytes(std::uint64_t lists, bool wide) {
  return wide ? lists * wordBytes : (lists + shared::countsPerWord - 1) / shared::countsPerWord * wordBytes;
}

/// Offset of a list's count among all counts; the list must begin a word.
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
      counts_(device_, gpu::infoOf<shared::CountsConstants>("counts")),
      tooLarge_(device_, wordBytes, MemoryKind::Readback) {
  const auto ranks = static_cast<std::size_t>(comm.size());
  pieces_.reserve(ranks);
  sent_.reserve(ranks);
}

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
  if (constants.words > 0) commands.dispatchMany(counts_, constants, constants.words, shared::countsGroup);
}

/// Packs all lists' counts in packed_, and the offset of each rank's supersegments in boundaryOffsets_.
void Distributor::recordPack(gpu::Commands& commands, const DeviceLists& lists,
                             const comm::Ownership& owned) {
  const auto ranks = static_cast<std::size_t>(comm_.size());
  boundaryOffsets_.reserve(device_, (ranks + 1) * wordBytes, MemoryKind::Readback);
  tooLarge_.mappedAs<std::uint32_t>()[0] = 0;
  recordCounts(commands, lists, false);
  for (std::size_t rank = 0; rank <= ranks; ++rank) {
    const std::uint64_t list = rank < ranks ? owned.of(static_cast<int>(rank)).first : lists.listCount;
    commands.copy(lists.offsets, list * wordBytes, boundaryOffsets_, rank * wordBytes, wordBytes);
  }
}

/// Packs all counts as words, because one of them does not fit into a byte.
void Distributor::packWide(const DeviceLists& lists) {
  commands_.begin();
  recordCounts(commands_, lists, true);
  commands_.submitAndWait();
}

Distributor::Stretch Distributor::stretchOf(int rank, const comm::Ownership& owned) const {
  const std::span<const std::uint32_t> boundaries = boundaryOffsets_.mappedAs<std::uint32_t>();
  const auto index = static_cast<std::size_t>(rank);
  return {owned.of(rank), boundaries[index], boundaries[index + 1] - boundaries[index]};
}

/// Lays out the parts for other ranks, and returns the bytes of the outbox.
std::uint64_t Distributor::layOutPieces(const comm::Ownership& owned, std::uint64_t segmentBytes) {
  bytesSent_ = 0;
  pieces_.clear();
  sent_.clear();
  std::uint64_t outboxBytes = 0;
  for (int rank = 0; rank < comm_.size(); ++rank) {
    const Stretch stretch = stretchOf(rank, owned);
    if (rank == comm_.rank() || stretch.segments == 0) continue;
    comm::Exchange::Outgoing piece;
    piece.to = rank;
    piece.at = outboxBytes;
    piece.bytes = aligned(packedBytes(stretch.lists.count(), wide_)) + stretch.segments * segmentBytes;
    piece.note = {stretch.segments, wide_ ? 1U : 0U};
    outboxBytes += aligned(piece.bytes);
    bytesSent_ += piece.bytes;
    pieces_.push_back(piece);
    sent_.push_back(stretch);
  }
  return outboxBytes;
}

/// Copies the parts for other ranks to the outbox.
void Distributor::fillOutbox(const comm::Exchange::Place& outbox, const DeviceLists& lists,
                             std::uint64_t segmentBytes) {
  if (pieces_.empty()) return;
  HostAccess& access = accesses_.of(outbox.memory);
  transfers_.begin();
  transfers_.waitFor(lists.written);
  if (wide_) transfers_.waitFor(commands_);
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    const comm::ListRange range = sent_[i].lists;
    const std::uint64_t at = outbox.at + pieces_[i].at;
    const std::uint64_t countBytes = packedBytes(range.count(), wide_);
    access.recordWrite(transfers_, packed_, packedAt(range.first, wide_), at, countBytes);
    access.recordWrite(transfers_, lists.segments, sent_[i].firstSegment * segmentBytes,
                       at + aligned(countBytes), sent_[i].segments * segmentBytes);
  }
  transfers_.submitAndWait();
  access.finish();
}

/// The parts that this rank owns, by sender; its own among the received ones.
std::vector<SubLists> Distributor::subListsOf(std::span<const comm::Exchange::Incoming> incoming,
                                              const Stretch& kept, std::uint64_t segmentBytes) {
  std::vector<SubLists> subLists;
  const auto addOwn = [&] {
    if (kept.segments == 0) return;
    subLists.push_back(
        {nullptr, packedAt(kept.lists.first, wide_), wide_, kept.firstSegment * segmentBytes, kept.segments});
  };
  bool ownAdded = false;
  for (const comm::Exchange::Incoming& piece : incoming) {
    if (!ownAdded && piece.from > comm_.rank()) {
      addOwn();
      ownAdded = true;
    }
    const bool wide = piece.note[1] != 0;
    subLists.push_back({&accesses_.of(piece.place.memory), piece.place.at, wide,
                        piece.place.at + aligned(packedBytes(kept.lists.count(), wide)), piece.note[0]});
  }
  if (!ownAdded) addOwn();
  return subLists;
}

Distributed Distributor::distribute(const DeviceLists& lists, const comm::Ownership& owned,
                                    std::uint64_t segmentBytes) {
  wide_ = tooLarge_.mappedAs<std::uint32_t>()[0] != 0;
  const comm::Exchange::Place outbox = exchange_.outbox(layOutPieces(owned, segmentBytes));
  comm_.together([&] {
    accesses_.tidy();
    if (wide_) packWide(lists);
    fillOutbox(outbox, lists, segmentBytes);
  });
  const std::span<const comm::Exchange::Incoming> incoming = exchange_.send(pieces_);

  const Stretch kept = stretchOf(comm_.rank(), owned);
  Distributed result;
  result.ownCounts = &packed_;
  result.ownSegments = &lists.segments;
  result.ownWritten = wide_ ? commands_.last() : lists.written;
  result.listCount = static_cast<std::uint32_t>(kept.lists.count());
  result.segmentBytes = segmentBytes;
  comm_.together([&] { result.subLists = subListsOf(incoming, kept, segmentBytes); });
  for (const SubLists& sub : result.subLists) result.total += sub.count;
  return result;
}

}  // namespace vdi::detail
