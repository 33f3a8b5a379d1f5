// The parts of a .vdi file, for writers that do not have all lists at once (docs/format.md): chunks, and the
// bytes before and after them. io::encode uses them too, so both ways make the same file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "vdi/core/Vdi.h"

namespace vdi::io {

/// The header at the file's beginning. It has a checksum of the chunk table, which has those of all chunks.
inline constexpr std::size_t fileHeaderBytes = 240;

/// Lists in each chunk; the last chunk of a file may have fewer.
inline constexpr std::uint64_t listsPerChunk = 4096;
constexpr std::uint64_t chunksOf(std::uint64_t lists, std::uint64_t perChunk = listsPerChunk) {
  return (lists + perChunk - 1) / perChunk;
}

/// A chunk's entry in the file's table.
struct ChunkEntry {
  std::uint32_t supersegmentCount;
  std::uint32_t packedBytes;
  std::uint64_t checksum;
};

struct EncodedChunk {
  ChunkEntry entry{};
  std::vector<std::byte> bytes;  // [entry.packedBytes], as they lie in the file
};

/// Encodes whole chunks, on several threads. `take` gets them in order, on the calling thread; only a few
/// exist at a time. `lists` are some of the VDI's. Those in [first, last) are encoded: a multiple of
/// listsPerChunk, or all up to the VDI's last. `firstList` is the index in the VDI of list `first`, a
/// multiple of listsPerChunk. `code` belongs to compact lists. Throws Error{Format} for lists that decode
/// would refuse, Error{Io} for a chunk beyond 2 GiB, and any exception of `take`.
template <typename Segment>
void encodeChunks(const ListsOf<Segment>& lists, std::size_t first, std::size_t last, std::uint64_t firstList,
                  std::uint32_t budget, const DepthCode& code, const std::function<void(EncodedChunk)>& take);

/// The number of bytes before the first chunk in a file of `lists` lists.
std::uint64_t headBytes(std::uint64_t lists);
/// The bytes before the first chunk. Uses only the precision of the lists of `vdi`. `table` has all chunks.
/// Throws Error{Format} for a VDI that decode would refuse.
std::vector<std::byte> encodeHead(const Vdi& vdi, std::span<const ChunkEntry> table);
/// The bytes after the last chunk, which exist if the VDI has a coloring. Throws as encodeHead.
std::vector<std::byte> encodeTail(const Vdi& vdi);

}  // namespace vdi::io
