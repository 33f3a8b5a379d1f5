// Encodes a chunk of lists as bytes: prediction, byte planes, LZ4. docs/format.md describes it ("Encoding 0"
// of floats, "Encoding 1" of codes). Not part of the library's interface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "vdi/core/Encoding.h"
#include "vdi/core/HostVector.h"

namespace vdi::io::detail {

/// Whether an LZ4 block of `packedBytes` can expand to `bytes`. A decoder checks this before it
/// allocates memory.
bool canExpandTo(std::uint64_t packedBytes, std::uint64_t bytes);

/// The expanded size that an LZ4 block announces, found without expanding it; nullopt if the block is cut
/// short.
std::optional<std::uint64_t> announcedBytes(std::span<const std::byte> packed);

/// Memory for one chunk at a time, which later chunks reuse.
struct PackScratch {
  HostVector<std::byte> plain;
  HostVector<std::byte> packed;
};

/// Encodes lists [first, last), together with their code if they are compact. Lossless and deterministic.
/// Throws Error{Io} for more than LZ4 takes at once (2 GiB).
template <typename Segment>
std::vector<std::byte> packLists(const ListsOf<Segment>& lists, const DepthCode& code, std::size_t first,
                                 std::size_t last, PackScratch& scratch);

/// Decodes a chunk into place and returns its depth code. ends[i] becomes `before` plus the supersegments of
/// lists 0 .. i of the chunk. Throws Error{Format} unless the bytes have exactly ends.size() lists with
/// segments.size() supersegments in all. Requires canExpandTo(packed.size(), chunkBytes(ends.size(),
/// segments.size(), precision)).
template <typename Segment>
DepthCode unpackLists(std::span<const std::byte> packed, std::uint32_t before, std::span<std::uint32_t> ends,
                      std::span<Segment> segments);

}  // namespace vdi::io::detail
