// Who composites which list, and the exchange of compact sub-VDIs (paper, section 5.2): direct send, then
// gather.
#pragma once

#include <cstdint>
#include <vector>

#include "vdi/comm/Communicator.h"
#include "vdi/core/Scene.h"
#include "vdi/core/Supersegment.h"

namespace vdi::comm {

/// Lists [first, last) of the image belong to one rank. Pure arithmetic: no communication.
struct ListRange {
  std::uint64_t first = 0;
  std::uint64_t last = 0;
  std::uint64_t count() const { return last - first; }
  bool operator==(const ListRange&) const = default;
};
/// Contiguous, in rank order, sizes differ by at most one; empty for surplus ranks when ranks > lists.
ListRange ownedLists(std::uint64_t listCount, int rank, int size);

/// What the owner received: subLists[r] is rank r's part of the owner's lists, ownedLists().count() lists
/// each.
template <typename Segment>
struct Received {
  std::vector<ListsOf<Segment>> subLists;
  std::uint64_t bytesSent = 0;      // by this rank to other ranks: supersegments and counts
  std::uint64_t bytesReceived = 0;  // from other ranks
};
/// Collective. `sub` holds all lists of the image on every rank. Every rank throws (Error{Communication} or
/// Error{RemoteRank}) when the ranks' images differ in size, or when what one receives isn't what the counts
/// announced.
template <typename Segment>
Received<Segment> distribute(const Communicator& comm, const ListsOf<Segment>& sub);

/// Collective. `owned` holds this rank's ownedLists; the root's result holds all lists, the others' none.
/// Every rank throws when a rank hands in another number of lists than it owns.
template <typename Segment>
ListsOf<Segment> gatherLists(const Communicator& comm, const ListsOf<Segment>& owned, int root);

/// Collective: the union of every rank's localScene.
Scene globalScene(const Communicator& comm, const Scene& local);

}  // namespace vdi::comm
