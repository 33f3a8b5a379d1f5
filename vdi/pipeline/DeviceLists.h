// Lists on a device, and their download to the host. Not part of the library's interface.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "vdi/core/Encoding.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/Memory.h"
#include "vdi/gpu/ScanPass.h"
#include "vdi/pipeline/HostAccess.h"

namespace vdi::detail {

constexpr std::uint64_t wordBytes = sizeof(std::uint32_t);

/// Lists without gaps as in ListsOf, in device memory that later lists reuse.
struct DeviceLists {
  gpu::Buffer offsets;   // u32 [listCount + 1], exclusive prefix sum
  gpu::Buffer segments;  // [count], of an encoding's type
  std::uint32_t listCount = 0;
  std::uint64_t count = 0;
  gpu::Submission written;  // other queues wait for this
};

/// Empty lists whose memory comes from `pool`.
template <typename Segment>
ListsOf<Segment> listsIn(const std::shared_ptr<HostPool>& pool) {
  ListsOf<Segment> lists;
  lists.offsets = HostVector<std::uint32_t>(1, 0, HostAllocator<std::uint32_t>(pool));
  lists.segments = HostVector<Segment>(HostAllocator<Segment>(pool));
  return lists;
}

/// Memory and commands that downloads keep from frame to frame.
struct DownloadMemory {
  explicit DownloadMemory(const std::shared_ptr<gpu::Device>& theDevice)
      : device(theDevice),
        transfers{gpu::Commands(theDevice, gpu::QueueKind::Transfer),
                  gpu::Commands(theDevice, gpu::QueueKind::Transfer)},
        commands(theDevice),
        scan(theDevice) {}
  std::shared_ptr<gpu::Device> device;
  std::array<gpu::Commands, 2> transfers;  // taken in turns
  gpu::Commands commands;
  gpu::ScanPass scan;
  gpu::Buffer offsets;  // offsets of all bands
};

/// Downloads lists to the host, band after band, while the device makes the next ones. Supersegments are sent
/// as soon as their band is made. Offsets follow at the end, when the first list of each band has its final
/// offset.
template <typename Segment>
class ListDownload {
 public:
  /// `lists` come from listsIn(pool). `expected` is the number of supersegments to make room for; more of
  /// them cost another copy.
  ListDownload(ListsOf<Segment>& lists, HostPool& pool, DownloadMemory& memory, std::uint64_t listCount,
               std::uint64_t expected);
  ~ListDownload();
  ListDownload(const ListDownload&) = delete;
  ListDownload& operator=(const ListDownload&) = delete;
  ListDownload(ListDownload&&) = delete;
  ListDownload& operator=(ListDownload&&) = delete;

  /// Call after recording the steps that make the band; `firstList` is the band's first list.
  void recordOffsets(gpu::Commands& commands, const DeviceLists& band, std::uint64_t firstList);
  /// Sends bands in their order, each when it is made. Returns the submission that uses the band's memory.
  gpu::Submission send(const DeviceLists& band);
  /// Waits until the lists are on the host.
  void finish();

 private:
  void makeRoom(std::uint64_t count);
  void downloadOffsets();
  /// Whether one band is the whole picture.
  bool isWhole() const { return bands_.size() == 1 && bands_.front().listCount == listCount_; }
  void waitForTransfers();

  struct SentBand {
    std::uint64_t firstList = 0;
    std::uint32_t listCount = 0;
    std::uint64_t firstSegment = 0;
  };
  ListsOf<Segment>& lists_;
  HostPool& pool_;
  DownloadMemory& memory_;
  std::uint64_t listCount_;
  std::uint64_t firstList_ = 0;  // first list of the next band
  std::vector<SentBand> bands_;
};

}  // namespace vdi::detail
