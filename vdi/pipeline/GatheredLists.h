// A VDI's lists on their way from their owners to the root. Not part of the library's interface.
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
  std::uint64_t firstList = 0;  // of the picture's
  DeviceLists lists;
};

/// Supersegments are sent as soon as a band is composited, to memory that's as large as what was expected. If
/// they don't fit, all of them are sent anew at the end.
template <typename Segment>
class GatheredLists {
 public:
  /// `gather` and `memory` are this object's until it goes.
  GatheredLists(const comm::Communicator& comm, int root, std::shared_ptr<HostPool> pool, Gather& gather,
                DownloadMemory& memory, std::uint64_t listCount);

  /// Collective: room on the root for that many supersegments.
  void begin(std::uint64_t expected);
  /// Not collective: bands in their order, each when it's composited. `lists`: the rank's own, from the
  /// picture's list `firstList` on, which must stay until finish. `counts`: all ranks' supersegments in the
  /// band. All offsets follow the last band.
  void send(const DeviceLists& lists, std::uint64_t firstList, std::span<const std::uint64_t> counts,
            bool last);
  /// Collective: the lists, on the root; elsewhere there are none.
  ListsOf<Segment> finish();

  std::uint64_t total() const { return total_; }  // supersegments of all bands that were sent

 private:
  /// A band, and its first supersegment among all.
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
