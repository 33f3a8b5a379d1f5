// The .vdi file. docs/format.md has the byte map. No function here is collective.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "vdi/core/Vdi.h"

namespace vdi::io {

/// The part of a file that a reader knows without decompressing the lists.
struct VdiFileInfo {
  std::uint32_t version = 0;
  Vdi header;  // everything but the lists and their depth code; its precision() is right
  std::uint64_t supersegmentCount = 0;
  std::uint64_t storedBytes = 0;    // whole file
  std::uint64_t expandedBytes = 0;  // offsets and supersegments in memory
  /// The header's checksum. Through that of the chunk table, it depends on the lists, too. The metadata have
  /// their own.
  std::uint64_t checksum = 0;
};

/// Encodes a VDI without loss in its precision, with LZ4 and checksums. Deterministic: equal VDIs give equal
/// bytes on every machine (little-endian). Throws Error{Format} for a VDI that decode would refuse.
std::vector<std::byte> encode(const Vdi& vdi);
/// As encode, but calls `goesOn` on this thread before each chunk, and gives up once it returns false.
/// Returns nothing then.
std::optional<std::vector<std::byte>> encodeWhile(const Vdi& vdi, const std::function<bool()>& goesOn);
/// Throws Error{Format} for bytes that are truncated, altered, of another version or encoding, or whose
/// header or chunk table asks for more memory than the chunks can expand to (checked before allocation; they
/// expand at most 255 times), Error{OutOfMemory} for one that takes more memory than is available. The result
/// has passed validate(Vdi).
Vdi decode(std::span<const std::byte> bytes);
/// Decodes a VDI for each of the factors, which are at least 1. It keeps about one list in `factor` of each
/// row and of each column, unchanged. Throws as decode does, also for faults outside the lists that are kept.
/// Needs memory for the result only.
std::vector<Vdi> decodeThinned(std::span<const std::byte> bytes, const std::vector<int>& factors);
/// Reads header, chunk table and metadata only; the lists must be present, but need not be valid. Throws
/// Error{Format} for faults of these parts.
VdiFileInfo decodeInfo(std::span<const std::byte> bytes);

/// Writes the file atomically: a reader never sees half a file, and an existing file stays if writing fails.
/// Throws Error{Io}, or Error{Format} as encode; both with the path as context.
void writeVdi(const std::filesystem::path& path, const Vdi& vdi);
/// Throws Error{Io}, or Error{Format} and Error{OutOfMemory} as decode; with the path as context.
Vdi readVdi(const std::filesystem::path& path);
/// decodeInfo of a file, without reading the lists. Throws Error{Io} or Error{Format} with the path as
/// context.
VdiFileInfo readVdiInfo(const std::filesystem::path& path);

}  // namespace vdi::io
