// Each rank's lists to those who own them (paper, section 5.2). Not part of the library's interface.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "vdi/comm/Exchange.h"
#include "vdi/comm/Ownership.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/CountsPass.h"
#include "vdi/gpu/Device.h"
#include "vdi/pipeline/DeviceLists.h"
#include "vdi/pipeline/HostAccess.h"

namespace vdi::detail {

/// Memory of the host that a device has been made known to, as long as somebody else uses it.
class HostAccesses {
 public:
  explicit HostAccesses(std::shared_ptr<gpu::Device> device) : device_(std::move(device)) {}
  HostAccess& of(const std::shared_ptr<HostMemory>& memory);
  /// Forgets those that nobody else uses any more.
  void tidy();

 private:
  std::shared_ptr<gpu::Device> device_;
  std::map<const HostMemory*, std::unique_ptr<HostAccess>> accesses_;
};

/// One rank's part of the lists that the receiver owns: their counts, then their supersegments.
struct SubLists {
  HostAccess* access = nullptr;  // null: this rank's own, on the device
  std::uint64_t countsAt = 0;    // bytes into the memory, or into Distributed::ownCounts
  bool wideCounts = false;       // a word each; else a byte
  std::uint64_t segmentsAt = 0;  // bytes into the memory, or into Distributed::ownSegments
  std::uint64_t count = 0;       // supersegments
};

/// What a rank has of the lists that it keeps, by sender; ranks that have none are left out. It stays until
/// the next distribution, or until the lists are made that were distributed.
struct Distributed {
  std::vector<SubLists> subLists;
  const gpu::Buffer* ownCounts = nullptr;
  const gpu::Buffer* ownSegments = nullptr;
  gpu::Submission ownWritten;  // these
  std::uint32_t listCount = 0;
  std::uint64_t segmentBytes = 0;
  std::uint64_t total = 0;  // supersegments
};

class Distributor {
 public:
  Distributor(std::shared_ptr<gpu::Device> device, const comm::Communicator& comm, comm::Transport transport);

  /// Behind the steps that make `lists`, the rank's part of all lists of a band: packs what the host and
  /// other ranks need to know of them. The compositor must be done with what was distributed before.
  void recordPack(gpu::Commands& commands, const DeviceLists& lists, const comm::Ownership& owned);
  /// Collective, when the packing is done. Lists travel by the transfer queue, so the device may make other
  /// lists meanwhile. What came stays until a distribution after the next one of this object or another.
  Distributed distribute(const DeviceLists& lists, const comm::Ownership& owned, std::uint64_t segmentBytes);
  /// Waits for what was submitted: after an error.
  void drop() { transfers_.drop(); }

  std::uint64_t bytesSent() const { return bytesSent_; }  // by the last one, to other ranks

 private:
  void recordCounts(gpu::Commands& commands, const DeviceLists& lists, bool wide);
  void packWide(const DeviceLists& lists);

  std::shared_ptr<gpu::Device> device_;
  const comm::Communicator& comm_;
  comm::Exchange exchange_;
  HostAccesses accesses_;
  gpu::Commands commands_;
  gpu::Commands transfers_;
  gpu::CountsPass counts_;
  gpu::Buffer packed_;
  gpu::Buffer tooLarge_;
  gpu::Buffer boundaryOffsets_;  // of the supersegments, where each stretch begins, [stretches + 1]
  bool wide_ = false;
  std::uint64_t bytesSent_ = 0;
};

}  // namespace vdi::detail
