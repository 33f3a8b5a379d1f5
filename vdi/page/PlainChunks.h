// Prepares a .vdi file for a compressor that does better than LZ4.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace vdi::page {

/// The same VDI as a .vdi file whose chunks aren't compressed: LZ4 blocks of only literals, with new
/// checksums. This file is larger than the original, but smaller after deflate than the original would be.
/// Throws Error{Format} for what io::decode refuses.
std::vector<std::byte> withPlainChunks(std::span<const std::byte> file);

}  // namespace vdi::page
