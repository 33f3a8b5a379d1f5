// 8-bit PNG files, through libpng.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <vector>

#include "vdi/core/Image.h"

namespace vdi::io {

/// 8-bit RGB, row 0 at the *top*, as in the file.
struct Picture {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;  // [height][width][3]
};

/// The image over a background, rounded to 8 bits and flipped vertically (Image has row 0 at the bottom).
Picture toPicture(const Image& image, const glm::vec3& background = glm::vec3(0.0F));

/// Premultiplied bytes over black, flipped vertically.
Picture toPicture(const ImageBytes& image);

void writePng(const std::filesystem::path& path, const Picture& picture);  // atomic; throws Error{Io}
Picture readPng(const std::filesystem::path& path);  // any PNG; throws Error{Io}, Error{Format}

}  // namespace vdi::io
