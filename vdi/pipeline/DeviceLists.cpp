#include "vdi/pipeline/DeviceLists.h"

#include <algorithm>
#include <cassert>
#include <initializer_list>
#include <limits>

#include "vdi/core/Error.h"

namespace vdi::detail {

template <typename Segment>
ListDownload<Segment>::ListDownload(ListsOf<Segment>& lists, HostPool& pool, DownloadMemory& memory,
                                    std::uint64_t listCount, std::uint64_t expected)
    : lists_(lists), pool_(pool), memory_(memory), listCount_(listCount) {
  lists_.offsets.resize(listCount + 1);
  lists_.segments.reserve(std::max<std::uint64_t>(expected, 1));
  memory_.offsets.reserve(memory_.device, (listCount + 1) * wordBytes, gpu::MemoryKind::DeviceLocal);
}

template <typename Segment>
ListDownload<Segment>::~ListDownload() {
  for (gpu::Commands& transfer : memory_.transfers) transfer.drop();
  memory_.commands.drop();
}

template <typename Segment>
void ListDownload<Segment>::recordOffsets(gpu::Commands& commands, const DeviceLists& band,
                                          std::uint64_t firstList) {
  if (firstList == 0 && band.listCount == listCount_) return;  // the band's offsets are downloaded unchanged
  // The last band also writes the final offset. Other bands leave that offset to the next band, which may run
  // before this one is repeated.
  const std::uint64_t words = band.listCount + (firstList + band.listCount == listCount_ ? 1 : 0);
  commands.copy(band.offsets, 0, memory_.offsets, firstList * wordBytes, words * wordBytes);
}

template <typename Segment>
void ListDownload<Segment>::waitForTransfers() {
  for (gpu::Commands& transfer : memory_.transfers) transfer.wait();
  for (const void* data : std::initializer_list<const void*>{lists_.offsets.data(), lists_.segments.data()}) {
    if (const HostPool::Place place = pool_.placeOf(data); place.access != nullptr) place.access->finish();
  }
}

/// If more supersegments arrive than expected, copies the present ones to larger memory. Assumes that the
/// following lists have as many.
template <typename Segment>
void ListDownload<Segment>::makeRoom(std::uint64_t count) {
  if (count <= lists_.segments.capacity()) return;
  waitForTransfers();
  const double share = static_cast<double>(listCount_) / static_cast<double>(firstList_);
  const auto expected = static_cast<std::uint64_t>(1.1 * share * static_cast<double>(count));
  lists_.segments.reserve(std::max(expected, count));
}

template <typename Segment>
gpu::Submission ListDownload<Segment>::send(const DeviceLists& band) {
  gpu::Commands& transfer = memory_.transfers[bands_.size() % memory_.transfers.size()];
  const std::uint64_t firstSegment = lists_.segments.size();
  if (firstSegment + band.count > std::numeric_limits<std::uint32_t>::max()) {
    throw Error(ErrorCode::OutOfMemory, "more than 2^32 supersegments in one VDI");
  }
  bands_.push_back({firstList_, band.listCount, firstSegment});
  firstList_ += band.listCount;
  makeRoom(firstSegment + band.count);
  lists_.segments.resize(firstSegment + band.count);
  transfer.begin();
  transfer.waitFor(band.written);
  if (isWhole()) {
    const HostPool::Place place = pool_.placeOf(lists_.offsets.data());
    place.access->recordWrite(transfer, band.offsets, 0, place.at, (listCount_ + 1) * wordBytes);
  }
  if (band.count > 0) {
    const HostPool::Place place = pool_.placeOf(lists_.segments.data() + firstSegment);
    place.access->recordWrite(transfer, band.segments, 0, place.at, band.count * sizeof(Segment));
  }
  transfer.submit();
  return transfer.last();
}

template <typename Segment>
void ListDownload<Segment>::finish() {
  assert(firstList_ == listCount_);
  if (!isWhole()) downloadOffsets();
  waitForTransfers();
}

/// Downloads all lists' offsets, counted from the picture's first supersegment.
template <typename Segment>
void ListDownload<Segment>::downloadOffsets() {
  memory_.commands.begin();
  for (const SentBand& band : bands_) {
    const std::uint32_t behind = band.firstList + band.listCount == listCount_ ? 1 : 0;
    memory_.scan.recordRebase(memory_.commands, memory_.offsets, band.firstList, band.listCount + behind,
                              static_cast<std::uint32_t>(band.firstSegment));
  }
  memory_.commands.barrier();
  const HostPool::Place place = pool_.placeOf(lists_.offsets.data());
  place.access->recordWrite(memory_.commands, memory_.offsets, 0, place.at, (listCount_ + 1) * wordBytes);
  memory_.commands.submitAndWait();
}

#define VDI_LIST_DOWNLOAD(Segment) template class ListDownload<Segment>;
VDI_EACH_ENCODING(VDI_LIST_DOWNLOAD)
#undef VDI_LIST_DOWNLOAD

}  // namespace vdi::detail
