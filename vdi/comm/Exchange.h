// Sends data from every rank to every other one (paper, section 5.2: direct send).
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

/// Direct send between the ranks of a communicator, through memory that devices can import. Within a host the
/// receiver reads from the sender's memory; between hosts, messages carry data from the sender's memory to
/// the receiver's. Ranks of a host also use messages if it has too little shared memory, or if they cannot
/// open each other's.
class Exchange {
 public:
  /// Not collective. `comm` must outlive it.
  Exchange(const Communicator& comm, Transport transport);

  /// A position in host memory.
  struct Place {
    std::shared_ptr<HostMemory> memory;
    std::uint64_t at = 0;
  };
  /// Collective. Returns the place for this rank's outgoing data, of at least `bytes`; this is the previous
  /// one if that is large enough. Invalidates the received data on all ranks. All ranks throw if one lacks
  /// memory.
  Place outbox(std::uint64_t bytes);

  using Note = std::array<std::uint64_t, 2>;  // for the receiver, with any meaning
  struct Outgoing {
    int to = 0;
    std::uint64_t at = 0;  // in bytes, relative to the outbox
    std::uint64_t bytes = 0;
    Note note{};
  };
  struct Incoming {
    int from = 0;
    Place place;
    std::uint64_t bytes = 0;
    Note note{};
  };
  /// Collective: sends data in the outbox to other ranks, at most one piece to each. Returns the received
  /// pieces, in rank order; they and their data stay valid until the next outbox. Ranks without data for each
  /// other exchange only a header.
  std::span<const Incoming> send(std::span<const Outgoing> pieces);

  /// Whether this rank reads the data of `rank` in place.
  bool sharesMemoryWith(int rank) const;

 private:
  static constexpr std::size_t headerWords = 4;
  void shareNewWindow(std::span<const std::uint64_t> sizes);
  bool openWindow(const std::string& name, std::uint64_t bytes);
  void putHeader(const Outgoing& piece, std::span<std::uint64_t> header) const;
  void addIncoming(int from, const std::uint64_t* header);
  void exchangeMessages(std::span<const Outgoing> pieces);

  const Communicator& comm_;
  Transport transport_;
  Place outbox_;
  /// The outboxes of this host's ranks, side by side. Either all of these ranks have it, or none.
  std::shared_ptr<HostMemory> window_;
  std::vector<std::uint64_t> parts_;   // sizes of all ranks' outboxes in windows; empty: no window yet
  bool everyHostShares_ = false;       // each host's ranks have a window
  bool messages_ = true;               // some pair of ranks has no window in common
  std::shared_ptr<HostMemory> inbox_;  // memory for received messages
  std::vector<std::uint64_t> sent_;    // headers: [size][headerWords]
  std::vector<std::uint64_t> received_;
  std::vector<Incoming> incoming_;  // has memory for one piece of each rank
};

}  // namespace vdi::comm
