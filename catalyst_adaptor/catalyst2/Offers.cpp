#include "catalyst_adaptor/catalyst2/Offers.h"

#include <cstddef>
#include <cstring>
#include <tuple>
#include <vector>

namespace vdi::catalyst {

namespace {

/// One array, in the bytes that ranks exchange; the name's bytes follow.
struct Entry {
  std::int32_t association = 0;
  std::int32_t components = 0;
  std::int32_t type = leftOutType;
  std::uint32_t nameBytes = 0;

  static constexpr std::int32_t leftOutType = -1;
  static constexpr std::int32_t blocksType = -2;  // no array: the rank has blocks
};

void append(std::vector<char>& bytes, Entry entry, const std::string& name) {
  entry.nameBytes = static_cast<std::uint32_t>(name.size());
  const auto* const from = reinterpret_cast<const char*>(&entry);
  bytes.insert(bytes.end(), from, from + sizeof entry);
  bytes.insert(bytes.end(), name.begin(), name.end());
}

std::vector<char> bytesOf(const Grid& grid) {
  std::vector<char> bytes;
  if (!grid.blocks().empty()) append(bytes, {0, 0, Entry::blocksType}, "");
  for (const auto& [key, array] : grid.arrays()) {
    const auto& [association, components, name] = key;
    append(bytes, {association, components, array.type}, name);
  }
  for (const std::string& name : grid.leftOut()) append(bytes, {}, name);
  return bytes;
}

/// The bytes of all ranks, one after the other.
std::vector<char> gathered(MPI_Comm comm, const std::vector<char>& own) {
  int ranks = 0;
  MPI_Comm_size(comm, &ranks);
  const int size = static_cast<int>(own.size());
  std::vector<int> sizes(static_cast<std::size_t>(ranks));
  MPI_Allgather(&size, 1, MPI_INT, sizes.data(), 1, MPI_INT, comm);
  std::vector<int> places(sizes.size());
  int total = 0;
  for (std::size_t rank = 0; rank < sizes.size(); ++rank) {
    places[rank] = total;
    total += sizes[rank];
  }
  std::vector<char> all(static_cast<std::size_t>(total));
  MPI_Allgatherv(own.data(), size, MPI_CHAR, all.data(), sizes.data(), places.data(), MPI_CHAR, comm);
  return all;
}

}  // namespace

Offers compareOffers(MPI_Comm comm, const Grid& grid) {
  const std::vector<char> all = gathered(comm, bytesOf(grid));
  Offers offers;
  std::map<Grid::Key, int> ranksWith;
  int ranksWithBlocks = 0;
  for (std::size_t at = 0; at < all.size();) {
    Entry entry;
    std::memcpy(&entry, all.data() + at, sizeof entry);
    at += sizeof entry;
    const std::string name(all.data() + at, entry.nameBytes);
    at += entry.nameBytes;
    if (entry.type == Entry::blocksType) {
      ++ranksWithBlocks;
    } else if (entry.type == Entry::leftOutType) {
      offers.leftOut.insert(name);
    } else {
      const Grid::Key key{entry.association, entry.components, name};
      ++ranksWith[key];
      offers.common.try_emplace(key, entry.type);
    }
  }
  for (const auto& [key, ranks] : ranksWith) {
    if (ranks == ranksWithBlocks) continue;
    offers.leftOut.insert(std::get<std::string>(key));
    offers.common.erase(key);
  }
  return offers;
}

}  // namespace vdi::catalyst
