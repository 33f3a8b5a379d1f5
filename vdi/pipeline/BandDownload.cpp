#include "vdi/pipeline/BandDownload.h"

#include <vector>

namespace vdi::detail {

BandDownload::BandDownload(std::shared_ptr<gpu::Device> device)
    : pool_(std::make_shared<HostPool>(device, HostPool::Visible::ToProcess)),
      transfer_(std::move(device), gpu::QueueKind::Transfer) {}

BandDownload::~BandDownload() {
  pool_->detach();
}

template <typename Segment>
ListsOf<Segment> BandDownload::get(const DeviceLists& band) {
  auto lists = listsIn<Segment>(pool_);
  lists.offsets.resize(std::size_t{band.listCount} + 1);
  lists.segments.resize(band.count);
  std::vector<HostAccess*> written;
  const auto record = [&](const gpu::Buffer& from, const void* to, std::uint64_t bytes) {
    if (bytes == 0) return;
    const HostPool::Place place = pool_->placeOf(to);
    place.access->recordWrite(transfer_, from, 0, place.at, bytes);
    written.push_back(place.access);
  };
  transfer_.begin();
  transfer_.waitFor(band.written);
  record(band.offsets, lists.offsets.data(), lists.offsets.size() * sizeof(std::uint32_t));
  record(band.segments, lists.segments.data(), lists.segments.size() * sizeof(Segment));
  transfer_.submitAndWait();
  for (HostAccess* access : written) access->finish();
  return lists;
}

#define VDI_BAND_DOWNLOAD(Segment) template ListsOf<Segment> BandDownload::get(const DeviceLists&);
VDI_EACH_ENCODING(VDI_BAND_DOWNLOAD)
#undef VDI_BAND_DOWNLOAD

}  // namespace vdi::detail
