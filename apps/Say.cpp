#include "apps/Say.h"

#include <fmt/format.h>

#include <cstdint>
#include <cstdio>

namespace vdi::apps {

namespace {

/// The character at the start of the text, and its number of bytes; 0 bytes if it isn't UTF-8.
std::pair<std::uint32_t, std::size_t> firstCharacter(std::string_view text) {
  const auto byte = [&](std::size_t i) {
    return static_cast<std::uint32_t>(static_cast<unsigned char>(text[i]));
  };
  const std::uint32_t first = byte(0);
  if (first < 0x80) return {first, 1};
  const std::size_t bytes = first >= 0xc2 && first < 0xe0   ? 2
                            : (first & 0xf0) == 0xe0        ? 3
                            : first >= 0xf0 && first < 0xf5 ? 4
                                                            : 0;
  if (bytes == 0 || text.size() < bytes) return {first, 0};
  std::uint32_t character = first & (0x7fU >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xc0) != 0x80) return {first, 0};
    character = character << 6U | (byte(i) & 0x3f);
  }
  const bool isShortest = character >= (bytes == 2 ? 0x80U : bytes == 3 ? 0x800U : 0x10000U);
  const bool isSurrogate = character >= 0xd800 && character < 0xe000;
  return {character, isShortest && !isSurrogate && character <= 0x10ffff ? bytes : 0};
}

/// Whether a terminal prints the character in its place.
bool isPlain(std::uint32_t character) {
  const bool controls = character < 0x20 || (character >= 0x7f && character < 0xa0);
  const bool endsLine = character == 0x2028 || character == 0x2029;
  const bool turns = character == 0x061c || character == 0x200e || character == 0x200f ||
                     (character >= 0x202a && character <= 0x202e) ||
                     (character >= 0x2066 && character <= 0x2069);
  return !controls && !endsLine && !turns;
}

}  // namespace

std::string printable(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const auto [character, bytes] = firstCharacter(text);
    if (bytes > 0 && isPlain(character)) {
      out += text.substr(0, bytes);
    } else if (character == '\n') {
      out += "\\n";
    } else {
      out += character < 0x100 ? fmt::format("\\x{:02x}", character) : fmt::format("\\u{:04x}", character);
    }
    text.remove_prefix(bytes == 0 ? 1 : bytes);
  }
  return out;
}

void say(std::string_view message) {
  fmt::print(stderr, "vdi: {}\n", printable(message));
}

std::pair<std::string, std::string> numbersApart(double a, double b) {
  std::pair<std::string, std::string> texts{fmt::format("{:g}", a), fmt::format("{:g}", b)};
  if (texts.first == texts.second && a != b) texts = {fmt::format("{}", a), fmt::format("{}", b)};
  return texts;
}

}  // namespace vdi::apps
