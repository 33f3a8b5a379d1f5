// PNG files, and pictures from images.
#include <png.h>

#include <limits>

#include "tests/Catch.h"
#include "tests/TemporaryFolder.h"
#include "tests/Thrown.h"
#include "tests/io/Samples.h"
#include "vdi/io/Files.h"
#include "vdi/io/Png.h"

using namespace vdi;
namespace fs = std::filesystem;

namespace {

io::Picture noisePicture(int width, int height) {
  io::Picture picture{width, height, {}};
  test::Noise noise(5);
  for (int i = 0; i < width * height * 3; ++i)
    picture.rgb.push_back(static_cast<std::uint8_t>(noise.below(256)));
  return picture;
}

/// Writes a 2 x 2 PNG in any of libpng's simplified formats.
void writeOther(const fs::path& path, png_uint_32 format, const std::vector<png_byte>& pixels,
                const std::vector<png_byte>& colormap = {}) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = 2;
  image.height = 2;
  image.format = format;
  image.colormap_entries = static_cast<png_uint_32>(colormap.size() / 3);
  REQUIRE(png_image_write_to_file(&image, path.c_str(), 0, pixels.data(), 0, colormap.data()) != 0);
}

std::uint32_t crc32(std::span<const std::byte> bytes) {
  std::uint32_t crc = ~0U;
  for (const std::byte byte : bytes) {
    crc ^= std::to_integer<std::uint32_t>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
  }
  return ~crc;
}

void putBigEndian(std::span<std::byte> to, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i) to[i] = static_cast<std::byte>(value >> (24 - 8 * i));
}

}  // namespace

TEST_CASE("a PNG gives back the picture that was written") {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "p.png";
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 3}, {256, 1}, {640, 360}}) {
    const io::Picture picture = noisePicture(width, height);
    io::writePng(path, picture);
    const io::Picture back = io::readPng(path);
    CHECK(back.width == width);
    CHECK(back.height == height);
    CHECK(back.rgb == picture.rgb);
  }
  CHECK(folder.fileCount() == 1);
}

TEST_CASE("row 0 of a picture is the top, row 0 of an image the bottom; backgrounds shine through") {
  Image image{2, 2, {}, {}};
  image.rgba = {{1.0F, 0.0F, 0.0F, 1.0F},     // bottom left: red
                {0.0F, 0.0F, 0.0F, 0.0F},     // bottom right: nothing
                {0.25F, 0.25F, 0.25F, 0.5F},  // top left: half grey
                {2.0F, -1.0F, std::numeric_limits<float>::quiet_NaN(), 1.0F}};
  const io::Picture picture = io::toPicture(image, {0.0F, 0.5F, 1.0F});
  CHECK(picture.rgb == std::vector<std::uint8_t>{64, 128, 191, 255, 0, 0, 255, 0, 0, 0, 128, 255});
  CHECK(io::toPicture(image).rgb[9] == 0);
}

TEST_CASE("grey, palette and RGBA files read as RGB") {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "p.png";
  writeOther(path, PNG_FORMAT_GRAY, {0, 85, 170, 255});
  CHECK(io::readPng(path).rgb ==
        std::vector<std::uint8_t>{0, 0, 0, 85, 85, 85, 170, 170, 170, 255, 255, 255});
  writeOther(path, PNG_FORMAT_RGB_COLORMAP, {0, 1, 1, 0}, {10, 20, 30, 40, 50, 60});
  CHECK(io::readPng(path).rgb == std::vector<std::uint8_t>{10, 20, 30, 40, 50, 60, 40, 50, 60, 10, 20, 30});
  writeOther(path, PNG_FORMAT_RGBA, {1, 2, 3, 255, 4, 5, 6, 255, 7, 8, 9, 255, 90, 90, 90, 0});
  CHECK(io::readPng(path).rgb == std::vector<std::uint8_t>{1, 2, 3, 4, 5, 6, 7, 8, 9, 0, 0, 0});
}

TEST_CASE("a file that is no PNG gives Error{Format}, a missing one Error{Io}, both with the path") {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "p.png";
  const auto reading = [&](const fs::path& file) {
    const Error error = test::errorOf([&] { io::readPng(file); });
    CHECK(error.context() == file.string());
    return error.code();
  };
  CHECK(reading(path) == ErrorCode::Io);
  CHECK(reading(folder.path()) == ErrorCode::Io);
  io::writeAtomically(path, {});
  CHECK(reading(path) == ErrorCode::Format);
  io::writeAtomically(path, std::as_bytes(std::span("not a picture at all, by any means")));
  CHECK(reading(path) == ErrorCode::Format);
  CHECK(test::errorOf([&] { io::writePng(folder.path() / "none" / "p.png", noisePicture(2, 2)); }).code() ==
        ErrorCode::Io);
}

TEST_CASE("a damaged PNG is refused or read, nothing else") {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "p.png";
  io::writePng(path, noisePicture(9, 5));
  const std::vector<std::byte> sound = io::InputFile(path).readAll();
  constexpr std::size_t endChunk = 12;
  for (std::size_t length = 0; length < sound.size() - endChunk - 4; ++length) {
    io::writeAtomically(path, std::span(sound).first(length));
    CHECK(test::errorOf([&] { io::readPng(path); }).code() == ErrorCode::Format);
  }
  for (std::size_t i = 0; i < sound.size(); ++i) {
    std::vector<std::byte> damaged = sound;
    damaged[i] ^= static_cast<std::byte>(1U << (i % 8));
    io::writeAtomically(path, damaged);
    try {
      const io::Picture picture = io::readPng(path);
      CHECK(picture.rgb.size() == static_cast<std::size_t>(picture.width * picture.height * 3));
    } catch (const Error& error) {
      CHECK(error.code() == ErrorCode::Format);
    }
  }
}

TEST_CASE("a PNG whose header asks for more than its bytes can hold is refused") {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "p.png";
  io::writePng(path, noisePicture(4, 4));
  std::vector<std::byte> bytes = io::InputFile(path).readAll();
  for (const std::uint32_t side : {20000U, 60000U, 900000U}) {
    putBigEndian(std::span(bytes).subspan(16),
                 side);  // width and height follow the signature, length and "IHDR"
    putBigEndian(std::span(bytes).subspan(20), side);
    putBigEndian(std::span(bytes).subspan(29), crc32(std::span(bytes).subspan(12, 17)));
    io::writeAtomically(path, bytes);
    const Error error = test::errorOf([&] { io::readPng(path); });
    CHECK(error.code() == ErrorCode::Format);
    CHECK(std::string(error.what()).find("more pixels than the file can hold") != std::string::npos);
  }
}
