// Encodes a chunk of lists as bytes: prediction, byte planes, LZ4. docs/format.md describes it ("Encoding 0"
// of floats, "Encoding 1" of codes). Not part of the library's interface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "vdi/core/Supersegment.h"

namespace vdi::io::detail {

/// Bytes of a chunk before LZ4. Codes of 14 or 12 bits take two bytes here, which LZ4 nearly undoes.
constexpr std::uint64_t expandedBytes(std::uint64_t lists, std::uint64_t supersegments, Precision precision) {
  const bool compact = precision == Precision::Compact;
  return (compact ? sizeof(DepthCode) : 0) + lists * sizeof(std::uint32_t) +
         supersegments * (compact ? 9 : 24);
}

/// Whether an LZ4 block of `packedBytes` can expand to `bytes`. A decoder checks this before it allocates.
bool canExpandTo(std::uint64_t packedBytes, std::uint64_t bytes);

/// The expanded size that an LZ4 block announces, found without expanding it; nullopt if the block is cut
/// short.
std::optional<std::uint64_t> announcedBytes(std::span<const std::byte> packed);

/// Encodes lists [first, last), together with their code if they are compact. Lossless and deterministic.
/// Throws Error{Io} for more than LZ4 takes at once (2 GiB).
template <typename Segment>
std::vector<std::byte> packLists(const ListsOf<Segment>& lists, const DepthCode& code, std::size_t first,
                                 std::size_t last);

/// Decodes a chunk into place and returns its depth code. ends[i] becomes `before` plus the supersegments of
/// lists 0 .. i of the chunk. Throws Error{Format} unless the bytes have exactly ends.size() lists with
/// segments.size() supersegments in all. Requires canExpandTo(packed.size(), expandedBytes(ends.size(),
/// segments.size(), precision)).
template <typename Segment>
DepthCode unpackLists(std::span<const std::byte> packed, std::uint32_t before, std::span<std::uint32_t> ends,
                      std::span<Segment> segments);

}  // namespace vdi::io::detail
