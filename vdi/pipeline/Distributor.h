// Sends each rank's lists to their owners (paper, section 5.2). Not part of the library's interface.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "vdi/comm/Exchange.h"
#include "vdi/comm/Ownership.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/ComputePipeline.h"
#include "vdi/gpu/Device.h"
#include "vdi/pipeline/DeviceLists.h"
#include "vdi/pipeline/HostAccess.h"

namespace vdi::detail {

/// Host memory that a device can access, kept as long as something else uses it.
class HostAccesses {
 public:
  explicit HostAccesses(std::shared_ptr<gpu::Device> device) : device_(std::move(device)) {}
  HostAccess& of(const std::shared_ptr<HostMemory>& memory);
  /// Forgets memory that nothing else uses any more.
  void tidy();

 private:
  std::shared_ptr<gpu::Device> device_;
  std::map<const HostMemory*, std::unique_ptr<HostAccess>> accesses_;
};

/// One rank's part of the lists that the receiver owns: counts, then supersegments.
struct SubLists {
  HostAccess* access = nullptr;  // null: this rank's own, on the device
  std::uint64_t countsAt = 0;    // bytes into the memory, or into Distributed::ownCounts
  bool wideCounts = false;       // a word for each count; else a byte
  std::uint64_t segmentsAt = 0;  // bytes into the memory, or into Distributed::ownSegments
  std::uint64_t count = 0;       // supersegments
};

/// All ranks' parts of the lists that this rank owns, by sender; ranks without any supersegments are left
/// out. They stay until the next distribution, or until the lists made from them are complete.
struct Distributed {
  std::vector<SubLists> subLists;
  const gpu::Buffer* ownCounts = nullptr;
  const gpu::Buffer* ownSegments = nullptr;
  gpu::Submission ownWritten;  // writes both buffers
  std::uint32_t listCount = 0;
  std::uint64_t segmentBytes = 0;
  std::uint64_t total = 0;  // supersegments
};

class Distributor {
 public:
  Distributor(std::shared_ptr<gpu::Device> device, const comm::Communicator& comm, comm::Transport transport);

  /// Call after recording the steps that make `lists`, this rank's part of all lists of a band: packs the
  /// counts that the host and other ranks need. The compositor must be done with the previous distribution.
  void recordPack(gpu::Commands& commands, const DeviceLists& lists, const comm::Ownership& owned);
  /// Collective; call when the packing is done. The transfer queue moves the lists, so the device may make
  /// other lists meanwhile. Received parts stay until the next but one distribution of any Distributor.
  Distributed distribute(const DeviceLists& lists, const comm::Ownership& owned, std::uint64_t segmentBytes);
  /// Waits for the submitted work. For use after an error.
  void drop() { transfers_.drop(); }

  std::uint64_t bytesSent() const { return bytesSent_; }  // to other ranks, by the last distribution

 private:
  /// One rank's share of a band's lists, and this rank's supersegments in it.
  struct Stretch {
    comm::ListRange lists;
    std::uint64_t firstSegment = 0;
    std::uint64_t segments = 0;
  };
  void recordCounts(gpu::Commands& commands, const DeviceLists& lists, bool wide);
  void packWide(const DeviceLists& lists);
  Stretch stretchOf(int rank, const comm::Ownership& owned) const;
  std::uint64_t layOutPieces(const comm::Ownership& owned, std::uint64_t segmentBytes);
  void fillOutbox(const comm::Exchange::Place& outbox, const DeviceLists& lists, std::uint64_t segmentBytes);
  std::vector<SubLists> subListsOf(std::span<const comm::Exchange::Incoming> incoming, const Stretch& kept,
                                   std::uint64_t segmentBytes);

  std::shared_ptr<gpu::Device> device_;
  const comm::Communicator& comm_;
  comm::Exchange exchange_;
  HostAccesses accesses_;
  gpu::Commands commands_;
  gpu::Commands transfers_;
  gpu::ComputePipeline counts_;  // packs lists' counts for exchange between ranks
  gpu::Buffer packed_;
  gpu::Buffer tooLarge_;
  gpu::Buffer boundaryOffsets_;  // number of supersegments before each stretch, [stretches + 1]
  std::vector<comm::Exchange::Outgoing> pieces_;  // has memory for one piece to each rank
  std::vector<Stretch> sent_;                     // the stretch of each piece
  bool wide_ = false;
  std::uint64_t bytesSent_ = 0;
};

}  // namespace vdi::detail
