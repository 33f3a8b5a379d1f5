// Accumulation that all of the reference's renderers share.
#pragma once

#include "vdi/core/Image.h"

namespace vdi::reference {

/// Colour and opacity accumulated front to back, and the depth of the first visible material.
class Accumulator {
 public:
  void add(const glm::vec3& color, float opacity, float depth) {
    if (!(opacity > 0.0F)) return;
    if (rgba_.a == 0.0F) depth_ = depth;
    rgba_ += (1.0F - rgba_.a) * glm::vec4(color, opacity);
  }
  const glm::vec4& rgba() const { return rgba_; }
  float depth() const { return depth_; }

 private:
  glm::vec4 rgba_{0.0F};
  float depth_ = Image::noDepth;
};

inline Image blankImage(int width, int height) {
  Image image{width, height, {}, {}};
  image.rgba.resize(image.pixelCount(), glm::vec4(0.0F));
  image.depth.resize(image.pixelCount(), Image::noDepth);
  return image;
}

}  // namespace vdi::reference
