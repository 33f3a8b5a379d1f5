// Sends a VDI's lists from their owners to the root. Not part of the library's interface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "vdi/comm/Communicator.h"
#include "vdi/core/Supersegment.h"
#include "vdi/pipeline/DeviceLists.h"
#include "vdi/pipeline/Gather.h"
#include "vdi/pipeline/HostAccess.h"

namespace vdi::detail {

/// A band's lists that this rank owns.
struct OwnedLists {
  std::uint64_t firstList = 0;  // position in the picture
  DeviceLists lists;
};

/// Sends supersegments as soon as a band is composited, to memory for the expected number. If they do not
/// fit, all are sent again at the end.
template <typename Segment>
class GatheredLists {
 public:
  /// `gather` and `memory` belong to this object as long as it lives.
  GatheredLists(const comm::Communicator& comm, int root, std::shared_ptr<HostPool> pool, Gather& gather,
                DownloadMemory& memory, std::uint64_t listCount);

  /// Collective: makes room on the root for that many supersegments.
  void begin(std::uint64_t expected);
  /// Not collective: sends bands in their order, each when it is composited. `lists` are this rank's, from
  /// the picture's list `firstList` on, and must stay until finish. `counts` are all ranks' supersegments in
  /// the band. All offsets follow the last band.
  void send(const DeviceLists& lists, std::uint64_t firstList, std::span<const std::uint64_t> counts,
            bool last);
  /// Collective: returns the lists on the root, and no lists elsewhere.
  ListsOf<Segment> finish();

  std::uint64_t total() const { return total_; }  // supersegments of all bands sent so far

 private:
  /// A sent band, and the position of its first supersegment.
  struct Sent {
    const DeviceLists* lists = nullptr;
    std::uint64_t firstList = 0;
    std::uint64_t firstSegment = 0;
  };
  bool isRoot() const { return comm_.rank() == root_; }
  void sendSegments(const Sent& sent);
  void sendOffsets();
  bool fits() const { return total_ <= room_; }

  const comm::Communicator& comm_;
  int root_;
  std::shared_ptr<HostPool> pool_;
  Gather& gather_;
  DownloadMemory& memory_;
  std::uint64_t listCount_;
  ListsOf<Segment> lists_;
  std::uint64_t room_ = 0;
  std::uint64_t total_ = 0;
  std::vector<Sent> sent_;
};

}  // namespace vdi::detail
