// What every rank has for every other one gets there (paper, section 5.2: direct send).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "vdi/comm/Communicator.h"
#include "vdi/comm/Transport.h"
#include "vdi/core/HostMemory.h"

namespace vdi::comm {

/// Direct send between the ranks of a communicator, through memory that devices can import. Between ranks of
/// one host the receiver reads where the sender wrote; between hosts messages go from the sender's memory to
/// the receiver's. A host without room for shared memory sends messages too, and so does one whose ranks
/// can't open each other's.
class Exchange {
 public:
  /// Not collective. `comm` must stay.
  Exchange(const Communicator& comm, Transport transport);

  /// A place in the host's memory.
  struct Place {
    std::shared_ptr<HostMemory> memory;
    std::uint64_t at = 0;
  };
  /// Collective. Where this rank is to put what it sends, `bytes` of it at least: the same as last time where
  /// that's large enough. What was received before is gone, on all ranks. All ranks throw if one is out of
  /// memory.
  Place outbox(std::uint64_t bytes);

  using Note = std::array<std::uint64_t, 2>;  // whatever the receiver should know
  struct Outgoing {
    int to = 0;
    std::uint64_t at = 0;  // bytes from the outbox's place on
    std::uint64_t bytes = 0;
    Note note{};
  };
  struct Incoming {
    int from = 0;
    Place place;
    std::uint64_t bytes = 0;
    Note note{};
  };
  /// Collective: sends to other ranks what's in the outbox, at most one piece to each. Returns what came, in
  /// rank order; it stays until the next outbox. Ranks that have nothing for each other exchange a header
  /// alone.
  std::vector<Incoming> send(std::span<const Outgoing> pieces);

  /// Whether what that rank sends is read where it wrote it.
  bool sharesMemoryWith(int rank) const;

 private:
  static constexpr std::size_t headerWords = 4;
  void shareNewWindow(std::span<const std::uint64_t> sizes);
  bool openWindow(const std::string& name, std::uint64_t bytes);
  void putHeader(const Outgoing& piece, std::span<std::uint64_t> header) const;
  void addIncoming(int from, const std::uint64_t* header, std::vector<Incoming>& incoming) const;
  std::vector<Incoming> receive(std::span<const Outgoing> pieces, std::vector<Incoming> incoming);

  const Communicator& comm_;
  Transport transport_;
  Place outbox_;
  std::shared_ptr<HostMemory>
      window_;  // of this host's ranks: their outboxes side by side; all have it, or none
  std::vector<std::uint64_t>
      parts_;                     // sizes of all ranks' outboxes in such windows; empty: there are none yet
  bool everyHostShares_ = false;  // each host's ranks have a window
  bool messages_ = true;          // some pair of ranks has no window in common
  std::shared_ptr<HostMemory> inbox_;  // of messages
};

}  // namespace vdi::comm
