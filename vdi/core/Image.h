// Pictures.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <limits>
#include <vector>

namespace vdi {

/// RGBA picture with depth. Row 0 is the bottom row.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<glm::vec4> rgba;  // [height][width], premultiplied
  /// [height][width]: view-space depth of the front of the first sample or supersegment that isn't
  /// transparent, world units; noDepth where there's none. May be empty when depth wasn't asked for.
  std::vector<float> depth;

  static constexpr float noDepth = std::numeric_limits<float>::infinity();

  std::size_t pixelCount() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
};

}  // namespace vdi
