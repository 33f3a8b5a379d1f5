// A chunk of lists as bytes: prediction, byte planes, LZ4. docs/format.md describes it ("Encoding 0"). Not
// part of the library's interface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "vdi/core/Vdi.h"

namespace vdi::io::detail {

/// Bytes of a chunk before LZ4.
constexpr std::uint64_t expandedBytes(std::uint64_t lists, std::uint64_t supersegments) {
  return lists * sizeof(std::uint32_t) + supersegments * sizeof(Supersegment);
}

/// Whether an LZ4 block of `packedBytes` can expand to `bytes`: what a decoder asks before it allocates.
bool canExpandTo(std::uint64_t packedBytes, std::uint64_t bytes);

/// Lists [first, last). Lossless, deterministic. Throws Error{Io} for more than LZ4 takes at once (2 GiB).
std::vector<std::byte> packLists(const SupersegmentLists& lists, std::size_t first, std::size_t last);

/// The inverse, into place: ends[i] becomes `before` plus the supersegments of lists 0 .. i of the chunk.
/// Throws Error{Format} unless the bytes hold just ends.size() lists of segments.size() supersegments in all.
/// Requires canExpandTo(packed.size(), expandedBytes(ends.size(), segments.size())).
void unpackLists(std::span<const std::byte> packed, std::uint32_t before, std::span<std::uint32_t> ends,
                 std::span<Supersegment> segments);

}  // namespace vdi::io::detail
