// The metadata of a .vdi file as JSON text (docs/format.md).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "vdi/core/Coloring.h"

namespace vdi::io {

/// The most that the text may take; a reader refuses more before it takes memory.
inline constexpr std::uint64_t maxMetadataBytes = std::uint64_t{1} << 20;

/// One JSON object in UTF-8. Equal for equal arguments. Bytes of the array's name that aren't UTF-8 become
/// U+FFFD. `time` and `timeStep` repeat what the file's header says, for readers of the text alone. Throws
/// Error{Format} for what validate(Coloring) refuses, and for a text beyond maxMetadataBytes.
std::string metadataText(const Coloring& coloring, double time, std::uint64_t timeStep);
/// The coloring in such a text; fields that this program doesn't know are skipped. Throws Error{Format}
/// unless the text is such an object and the coloring is sound.
Coloring coloringIn(std::string_view text);

}  // namespace vdi::io
