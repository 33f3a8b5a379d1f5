// The bytes of a .vdi file besides those of the lists (docs/format.md), for readers and writers in this
// folder. All functions throw Error{Format}.
#pragma once

#include <fmt/format.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "vdi/core/Encoding.h"
#include "vdi/core/Error.h"
#include "vdi/core/Estimate.h"
#include "vdi/core/Vdi.h"
#include "vdi/io/ListCodec.h"
#include "vdi/io/VdiParts.h"

namespace vdi::io::detail {

/// docs/format.md has the table of fields.
struct Header {
  std::array<char, 8> magic;
  std::uint32_t version;
  std::uint32_t headerBytes;
  std::uint32_t encoding;
  std::uint32_t flags;
  std::uint32_t width;
  std::uint32_t height;
  std::uint32_t budget;
  std::uint32_t listsPerChunk;
  std::uint32_t chunkCount;
  std::uint16_t marginX;  // 0 in version 1
  std::uint16_t marginY;
  std::uint64_t supersegmentCount;
  std::uint64_t dataBytes;
  std::uint64_t timeStep;
  double time;
  double sampleStep;
  double boundsLo[3];
  double boundsHi[3];
  double position[3];
  double focalPoint[3];
  double viewUp[3];
  double viewAngle;
  double parallelScale;
  std::uint64_t tableChecksum;
  std::uint64_t headerChecksum;
};
static_assert(offsetof(Header, version) == 8);
static_assert(offsetof(Header, headerBytes) == 12);
static_assert(offsetof(Header, encoding) == 16);
static_assert(offsetof(Header, flags) == 20);
static_assert(offsetof(Header, width) == 24);
static_assert(offsetof(Header, height) == 28);
static_assert(offsetof(Header, budget) == 32);
static_assert(offsetof(Header, listsPerChunk) == 36);
static_assert(offsetof(Header, chunkCount) == 40);
static_assert(offsetof(Header, marginX) == 44);
static_assert(offsetof(Header, marginY) == 46);
static_assert(offsetof(Header, supersegmentCount) == 48);
static_assert(offsetof(Header, dataBytes) == 56);
static_assert(offsetof(Header, timeStep) == 64);
static_assert(offsetof(Header, time) == 72);
static_assert(offsetof(Header, sampleStep) == 80);
static_assert(offsetof(Header, boundsLo) == 88);
static_assert(offsetof(Header, boundsHi) == 112);
static_assert(offsetof(Header, position) == 136);
static_assert(offsetof(Header, focalPoint) == 160);
static_assert(offsetof(Header, viewUp) == 184);
static_assert(offsetof(Header, viewAngle) == 208);
static_assert(offsetof(Header, parallelScale) == 216);
static_assert(offsetof(Header, tableChecksum) == 224);
static_assert(offsetof(Header, headerChecksum) == 232);
static_assert(sizeof(Header) == fileHeaderBytes);

/// Precedes the metadata, which are the file's last part.
struct MetadataHeader {
  std::array<char, 4> kind;
  std::uint32_t bytes;  // of the following text
  std::uint64_t checksum;
};
static_assert(offsetof(MetadataHeader, bytes) == 4);
static_assert(offsetof(MetadataHeader, checksum) == 8);
static_assert(sizeof(MetadataHeader) == 16);
inline constexpr std::array<char, 4> kindJson{'J', 'S', 'O', 'N'};

static_assert(offsetof(ChunkEntry, packedBytes) == 4);
static_assert(offsetof(ChunkEntry, checksum) == 8);
static_assert(sizeof(ChunkEntry) == 16);

/// A chunk's position in the file and in the VDI.
struct Chunk {
  std::uint64_t dataOffset;  // in the bytes after the table
  std::uint64_t packedBytes;
  std::uint64_t checksum;
  std::uint64_t firstList;
  std::uint64_t listCount;
  std::uint64_t firstSupersegment;
  std::uint64_t supersegmentCount;
};

[[noreturn]] void fail(const std::string& what);

std::uint64_t checksumOf(std::span<const std::byte> bytes);
std::uint64_t checksumOf(std::span<const ChunkEntry> table);
std::uint64_t checksumOf(const Header& header);

inline Precision precisionOf(const Header& header) {
  return static_cast<Precision>(header.encoding);
}
inline std::uint64_t listsOf(const Vdi& vdi) {
  return static_cast<std::uint64_t>(vdi.width) * static_cast<std::uint64_t>(vdi.height);
}
inline std::uint64_t tableBytesOf(const Header& header) {
  return header.chunkCount * sizeof(ChunkEntry);
}
/// Offset of the metadata in the file, or the file's end.
inline std::uint64_t metadataOffset(const Header& header) {
  return sizeof(Header) + tableBytesOf(header) + header.dataBytes;
}

/// Bytes of the decoded lists.
inline std::uint64_t bytesInMemoryOf(const Header& header) {
  return bytesInMemory<std::uint64_t>(std::uint64_t{header.width} * header.height + 1,
                                      header.supersegmentCount, precisionOf(header));
}

/// Checks what validate(Vdi) does not: a usable camera and finite numbers.
void requireSoundHeader(const Vdi& vdi);
/// The header without the fields that depend on the chunks.
Header fileHeaderOf(const Vdi& vdi);
/// The VDI that the header describes, without lists.
Vdi vdiOf(const Header& header);

/// The header of a file of `fileBytes` that begins with `start`. Version and encoding are checked before the
/// checksum, so that the error for a file of a later version says so.
Header parseHeader(std::span<const std::byte> start, std::uint64_t fileBytes);
/// Parses the bytes from the end of the chunks to the end of the file.
std::optional<Coloring> parseMetadata(const Header& header, std::span<const std::byte> bytes);
/// Returns the table's chunks after checking that the file can hold their contents.
std::vector<Chunk> parseTable(const Header& header, std::span<const std::byte> bytes);
/// Checks, before memory is allocated, that the chunk is unaltered and expands to the size in the table.
void requireSound(const Chunk& chunk, std::span<const std::byte> packed, Precision precision);

/// Throws unless all chunks have the depth code `shared`.
void requireCode(const DepthCode& shared, std::span<const DepthCode> chunks);

/// Decodes a chunk into place (see detail::unpackLists, where `ends` and `segments` are explained) and
/// returns the depth code of its supersegments.
template <typename Segment>
DepthCode decodeChunk(const Chunk& chunk, std::span<const std::byte> packed, std::uint64_t before,
                      std::span<std::uint32_t> ends, std::span<Segment> segments) {
  try {
    return detail::unpackLists(packed, static_cast<std::uint32_t>(before), ends, segments);
  } catch (const Error& error) {
    fail(fmt::format("the chunk from list {} on: {}", chunk.firstList, error.what()));
  }
}

}  // namespace vdi::io::detail
