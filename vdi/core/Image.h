// Pictures.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <span>

#include "vdi/core/HostVector.h"

namespace vdi {

/// RGBA picture with depth. Row 0 is the bottom row.
struct Image {
  int width = 0;
  int height = 0;
  HostVector<glm::vec4> rgba;  // [height][width], premultiplied
  /// [height][width]: view-space depth of the front of the first sample or supersegment that is not
  /// transparent, world units; noDepth where all are transparent.
  HostVector<float> depth;

  static constexpr float noDepth = std::numeric_limits<float>::infinity();

  std::size_t pixelCount() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
};

/// A picture in the format that screens take, in memory that its producer owns. Row 0 is the bottom row.
struct ImageBytes {
  int width = 0;
  int height = 0;
  std::span<const glm::u8vec4> rgba;  // [height][width], premultiplied or straight
  std::span<const float> depth;       // [height][width], with the meaning of Image::depth
};

/// Whether colours are multiplied by their opacity or straight.
enum class Alpha { Premultiplied, Straight };

/// The nearest 8-bit code of a share in [0, 1], clamped; 0 for NaN. Rounds as std::lround, four times as
/// fast.
inline std::uint8_t toByte(float share) {
  if (!(share > 0.0F)) return 0;
  const float code = std::min(share, 1.0F) * 255.0F;
  const int whole = static_cast<int>(code);
  return static_cast<std::uint8_t>(code - static_cast<float>(whole) >= 0.5F ? whole + 1 : whole);
}

}  // namespace vdi
