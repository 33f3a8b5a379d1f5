#include "vdi/io/Png.h"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <span>
#include <string_view>

#include "vdi/core/Camera.h"
#include "vdi/core/Error.h"
#include "vdi/io/Files.h"

namespace vdi::io {

namespace {

/// Wraps libpng's simplified interface, which reports errors in the struct instead of a longjmp past our
/// destructors.
class PngImage {
 public:
  PngImage() { image_.version = PNG_IMAGE_VERSION; }
  ~PngImage() { png_image_free(&image_); }
  PngImage(const PngImage&) = delete;
  PngImage& operator=(const PngImage&) = delete;
  png_image* operator->() { return &image_; }
  png_image* get() { return &image_; }

 private:
  png_image image_{};
};

/// `byteOf` converts a pixel's channel.
template <typename Pixels, typename ByteOf>
Picture pictureOf(const Pixels& image, ByteOf byteOf) {
  Picture picture{image.width, image.height, {}};
  picture.rgb.resize(image.rgba.size() * 3);
  const auto width = static_cast<std::size_t>(image.width);
  const auto height = static_cast<std::size_t>(image.height);
  std::uint8_t* out = picture.rgb.data();
  for (std::size_t y = 0; y < height; ++y) {
    for (std::size_t x = 0; x < width; ++x) {
      const auto& rgba = image.rgba[(height - 1 - y) * width + x];
      for (int c = 0; c < 3; ++c) *out++ = byteOf(rgba, c);
    }
  }
  return picture;
}

/// Reads the first chunk of a valid PNG.
std::uint64_t bitsPerPixel(std::span<const std::byte> png) {
  constexpr std::size_t depthAt = 24;
  constexpr std::size_t colorTypeAt = 25;
  constexpr std::array<std::uint64_t, 7> channels{1, 0, 3, 1, 2, 0, 4};  // by colour type
  return std::to_integer<std::uint64_t>(png[depthAt]) *
         channels.at(std::to_integer<std::size_t>(png[colorTypeAt]));
}

}  // namespace

Picture toPicture(const Image& image, const glm::vec3& background) {
  return pictureOf(
      image, [&](const glm::vec4& rgba, int c) { return toByte(rgba[c] + (1.0F - rgba.a) * background[c]); });
}

Picture toPicture(const ImageBytes& image) {
  return pictureOf(image, [](const glm::u8vec4& rgba, int c) { return rgba[c]; });
}

void writePng(const std::filesystem::path& path, const Picture& picture) {
  assert(picture.rgb.size() ==
         std::size_t{3} * static_cast<unsigned>(picture.width) * static_cast<unsigned>(picture.height));
  PngImage image;
  image->width = static_cast<png_uint_32>(picture.width);
  image->height = static_cast<png_uint_32>(picture.height);
  image->format = PNG_FORMAT_RGB;
  // An upper bound of the size avoids compressing twice, once for the size and once for the bytes.
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(*image.get());
  std::vector<std::byte> bytes(size);
  if (png_image_write_to_memory(image.get(), bytes.data(), &size, 0, picture.rgb.data(), 0, nullptr) == 0) {
    throw Error(ErrorCode::Io, fmt::format("can't make a PNG: {}", image->message), path.string());
  }
  writeAtomically(path, std::span(bytes).first(size));
}

Picture readPng(const std::filesystem::path& path) {
  const InputFile file(path);
  const auto require = [&](bool good, std::string_view why) {
    if (!good) throw Error(ErrorCode::Format, fmt::format("invalid PNG: {}", why), path.string());
  };
  // Checks before it allocates memory for another file's bytes.
  constexpr std::uint64_t signatureBytes = 8;
  const std::vector<std::byte> start = file.read(0, std::min(file.size(), signatureBytes));
  require(start.size() == signatureBytes &&
              png_sig_cmp(reinterpret_cast<png_const_bytep>(start.data()), 0, signatureBytes) == 0,
          "it doesn't start as one");
  const std::vector<std::byte> bytes = file.readAll();
  PngImage image;
  require(png_image_begin_read_from_memory(image.get(), bytes.data(), bytes.size()) != 0, image->message);
  // A byte of a PNG expands to at most 1032 bytes of rows (deflate).
  constexpr std::uint64_t maxPerByte = 1032;
  require(std::uint64_t{image->width} * image->height * bitsPerPixel(bytes) <= bytes.size() * maxPerByte * 8,
          "the header claims more pixels than the file can hold");
  require(image->width <= View::maxSide && image->height <= View::maxSide,
          fmt::format("it's more than {} pixels wide or high", View::maxSide));
  image->format = PNG_FORMAT_RGB;
  Picture picture{static_cast<int>(image->width), static_cast<int>(image->height), {}};
  picture.rgb.resize(std::size_t{3} * image->width * image->height);
  const png_color black{0, 0, 0};
  require(png_image_finish_read(image.get(), &black, picture.rgb.data(), 0, nullptr) != 0, image->message);
  return picture;
}

}  // namespace vdi::io
