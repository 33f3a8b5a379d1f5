// The metadata of a .vdi file as JSON text (docs/format.md).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "vdi/core/Coloring.h"

namespace vdi::io {

/// The largest metadata text; a reader refuses more before it allocates memory.
inline constexpr std::uint64_t maxMetadataBytes = std::uint64_t{1} << 20;

/// Returns one JSON object in UTF-8, equal for equal arguments. Bytes of the array's name that are not UTF-8
/// become U+FFFD. `time` and `timeStep` repeat the file's header for readers that have only the text. Throws
/// Error{Format} for a coloring that validate(Coloring) rejects, and for a text beyond maxMetadataBytes.
std::string metadataText(const Coloring& coloring, double time, std::uint64_t timeStep);
/// Reads the coloring from a metadata text and skips unknown fields. Throws Error{Format} unless the text is
/// a JSON object with a valid coloring.
Coloring coloringIn(std::string_view text);

}  // namespace vdi::io
