// Lists on a device, and their way to the host. Not part of the library's interface.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "vdi/core/Supersegment.h"
#include "vdi/gpu/Memory.h"
#include "vdi/gpu/ScanPass.h"
#include "vdi/pipeline/HostAccess.h"

namespace vdi::detail {

/// Compact lists as in ListsOf, in device memory that's used again by the next ones.
struct DeviceLists {
  gpu::Buffer offsets;   // u32 [listCount + 1], exclusive prefix sum
  gpu::Buffer segments;  // [count], CompactSupersegments or Supersegments
  std::uint32_t listCount = 0;
  std::uint64_t count = 0;
};

/// Of one supersegment: compact lists have a depth code.
inline std::uint64_t segmentBytes(const DepthCode& code) {
  return code.step > 0.0F ? sizeof(CompactSupersegment) : sizeof(Supersegment);
}

/// Empty lists in memory of that pool.
template <typename Segment>
ListsOf<Segment> listsIn(const std::shared_ptr<HostPool>& pool) {
  ListsOf<Segment> lists;
  lists.offsets = HostVector<std::uint32_t>(1, 0, HostAllocator<std::uint32_t>(pool));
  lists.segments = HostVector<Segment>(HostAllocator<Segment>(pool));
  return lists;
}

/// Appends lists of a device to those of the host, band after band.
template <typename Segment>
class ListDownload {
 public:
  /// `lists`: of listsIn(pool).
  ListDownload(ListsOf<Segment>& lists, HostPool& pool) : lists_(lists), pool_(pool) {}

  /// A stage named "download". The band's offsets become those of the host's lists.
  void record(gpu::Commands& commands, gpu::ScanPass& scan, const DeviceLists& band);
  /// When the commands are done.
  void finish();

 private:
  ListsOf<Segment>& lists_;
  HostPool& pool_;
  std::vector<HostAccess*> written_;
};

}  // namespace vdi::detail
