// The .vdi file. Byte map: docs/format.md, guarded by static_asserts in VdiFile.cpp.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

#include "vdi/core/Vdi.h"

namespace vdi::io {

/// What a reader can know without decompressing the lists.
struct VdiFileInfo {
  std::uint32_t version = 0;
  Vdi header;  // everything but the lists
  std::uint64_t supersegmentCount = 0;
  std::uint64_t storedBytes = 0;    // whole file
  std::uint64_t expandedBytes = 0;  // offsets and supersegments in memory
};

/// LZ4, checksummed. Deterministic: equal VDIs give equal bytes on every machine (little-endian).
std::vector<std::byte> encode(const Vdi& vdi);
/// Throws Error{Format} for bytes that are truncated, altered, of another version, or whose header asks for
/// more memory than the file's own size can justify (before anything is allocated). The result has passed
/// validate(Vdi).
Vdi decode(std::span<const std::byte> bytes);
VdiFileInfo decodeInfo(std::span<const std::byte> bytes);

/// Written under a temporary name beside `path`, then renamed: a reader never sees half a file. Throws
/// Error{Io}.
void writeVdi(const std::filesystem::path& path, const Vdi& vdi);
/// Throws Error{Io} or Error{Format} with the path as context.
Vdi readVdi(const std::filesystem::path& path);
VdiFileInfo readVdiInfo(const std::filesystem::path& path);

}  // namespace vdi::io
