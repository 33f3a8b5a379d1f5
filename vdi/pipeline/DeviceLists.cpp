#include "vdi/pipeline/DeviceLists.h"

#include <limits>

#include "vdi/core/Error.h"

namespace vdi::detail {

template <typename Segment>
void ListDownload<Segment>::record(gpu::Commands& commands, gpu::ScanPass& scan, const DeviceLists& band) {
  const std::size_t firstList = lists_.listCount();
  const std::size_t firstSegment = lists_.segments.size();
  if (firstSegment + band.count > std::numeric_limits<std::uint32_t>::max()) {
    throw Error(ErrorCode::OutOfMemory, "more than 2^32 supersegments in one VDI");
  }
  lists_.offsets.resize(firstList + band.listCount + 1);
  lists_.segments.resize(firstSegment + band.count);
  if (firstSegment > 0) {
    scan.recordRebase(commands, band.offsets, band.listCount, static_cast<std::uint32_t>(firstSegment));
  }
  commands.barrier();
  commands.mark("download");
  const auto write = [&](const gpu::Buffer& from, const void* to, std::uint64_t bytes) {
    const HostPool::Place place = pool_.placeOf(to);
    place.access->recordWrite(commands, from, 0, place.at, bytes);
    written_.push_back(place.access);
  };
  write(band.offsets, lists_.offsets.data() + firstList,
        (std::uint64_t{band.listCount} + 1) * sizeof(std::uint32_t));
  if (band.count > 0) {
    write(band.segments, lists_.segments.data() + firstSegment, band.count * sizeof(Segment));
  }
}

template <typename Segment>
void ListDownload<Segment>::finish() {
  for (HostAccess* access : written_) access->finish();
  written_.clear();
}

template class ListDownload<Supersegment>;
template class ListDownload<CompactSupersegment>;

}  // namespace vdi::detail
