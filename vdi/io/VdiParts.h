// The parts of a .vdi file, for whoever doesn't have all lists at once (docs/format.md): chunks, and what
// stands in front of them. io::encode is made of these too, so that a file is the same by whatever way.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "vdi/core/Vdi.h"

namespace vdi::io {

/// In a chunk, but for a file's last one.
inline constexpr std::uint64_t listsPerChunk = 4096;
constexpr std::uint64_t chunksOf(std::uint64_t lists, std::uint64_t perChunk = listsPerChunk) {
  return (lists + perChunk - 1) / perChunk;
}

/// What the file's table says of a chunk.
struct ChunkEntry {
  std::uint32_t supersegmentCount;
  std::uint32_t packedBytes;
  std::uint64_t checksum;
};

struct EncodedChunk {
  ChunkEntry entry{};
  std::vector<std::byte> bytes;  // [entry.packedBytes], as they lie in the file
};

/// Encodes whole chunks, by several threads. `take` gets them in order, from the calling thread; a few are
/// held at a time. `lists`: some of the VDI's, of which those from `first` on, until before `last`, make up
/// chunks: there are a multiple of listsPerChunk of them, or they end where the VDI does. `firstList`: the
/// VDI's number of the first of these, a multiple of listsPerChunk. `code`: of compact lists. Throws
/// Error{Format} for lists that decode would refuse, Error{Io} for a chunk beyond 2 GiB, and what `take`
/// throws.
template <typename Segment>
void encodeChunks(const ListsOf<Segment>& lists, std::size_t first, std::size_t last, std::uint64_t firstList,
                  std::uint32_t budget, const DepthCode& code, const std::function<void(EncodedChunk)>& take);

/// Bytes in front of the first chunk, of a file of that many lists.
std::uint64_t headBytes(std::uint64_t lists);
/// Those bytes. `vdi`: of its lists there only has to be which precision they have. `table`: of all chunks.
/// Throws Error{Format} for what decode would refuse.
std::vector<std::byte> encodeHead(const Vdi& vdi, std::span<const ChunkEntry> table);
/// What follows the last chunk, of a VDI whose coloring is known; else nothing. Throws as encodeHead.
std::vector<std::byte> encodeTail(const Vdi& vdi);

}  // namespace vdi::io
