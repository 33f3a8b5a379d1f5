#include "vdi/io/Png.h"

#include <fmt/format.h>
#include <png.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <system_error>

#include "vdi/core/Error.h"

namespace vdi::io {

Picture toPicture(const Image& image, const glm::vec3& background) {
  Picture picture{image.width, image.height, {}};
  picture.rgb.resize(image.pixelCount() * 3);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const auto row = static_cast<std::size_t>(image.height - 1 - y);
      const auto column = static_cast<std::size_t>(x);
      const auto width = static_cast<std::size_t>(image.width);
      const glm::vec4& rgba = image.rgba[row * width + column];
      std::uint8_t* out = &picture.rgb[(static_cast<std::size_t>(y) * width + column) * 3];
      for (int c = 0; c < 3; ++c) {
        const float value = rgba[c] + (1.0F - rgba.a) * background[c];
        out[c] = static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0F, 1.0F) * 255.0F));
      }
    }
  }
  return picture;
}

// libpng's simplified interface: it reports errors in the struct instead of by longjmp.

void writePng(const std::filesystem::path& path, const Picture& picture) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format = PNG_FORMAT_RGB;
  const std::filesystem::path temporary = path.string() + fmt::format(".{}.tmp", ::getpid());
  const int written = png_image_write_to_file(&image, temporary.c_str(), 0, picture.rgb.data(), 0, nullptr);
  std::error_code error;
  if (written != 0) std::filesystem::rename(temporary, path, error);
  if (written == 0 || error) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    throw Error(ErrorCode::Io,
                fmt::format("can't write the PNG: {}", written == 0 ? image.message : error.message()),
                path.string());
  }
}

Picture readPng(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error))
    throw Error(ErrorCode::Io, "can't open the file", path.string());
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&image, path.c_str()) == 0) {
    throw Error(ErrorCode::Format, fmt::format("not a PNG: {}", image.message), path.string());
  }
  image.format = PNG_FORMAT_RGB;
  Picture picture{static_cast<int>(image.width), static_cast<int>(image.height), {}};
  picture.rgb.resize(PNG_IMAGE_SIZE(image));
  const png_color black{0, 0, 0};
  if (png_image_finish_read(&image, &black, picture.rgb.data(), 0, nullptr) == 0) {
    throw Error(ErrorCode::Format, fmt::format("not a PNG: {}", image.message), path.string());
  }
  return picture;
}

}  // namespace vdi::io
