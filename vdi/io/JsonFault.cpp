#include "vdi/io/JsonFault.h"

#include <fmt/format.h>

#include <algorithm>

namespace vdi::io {

std::string jsonFault(std::string_view text, std::size_t taken, int id) {
  constexpr int overflow = 406;  // out_of_range
  if (id == overflow) return "a number is too large";
  if (taken > text.size()) return "it ends too early";
  const std::size_t at = taken == 0 ? 0 : taken - 1;
  const auto byte = static_cast<unsigned char>(text[at]);
  if (byte == '\n') return "a line ends within a string or a word";
  if (byte < ' ' || byte == 0x7f) return fmt::format("it has the control character U+{:04X}", byte);
  if (byte >= 0x80) return "it isn't UTF-8, or has such a character outside strings";
  constexpr std::size_t before = 20;
  const std::size_t start = text.rfind('\n', at) + 1;  // npos + 1 is 0
  std::size_t from = std::max(start, at > before ? at - before : 0);
  while (from < at && (static_cast<unsigned char>(text[from]) & 0xc0U) == 0x80) ++from;  // a whole character
  if (from == at) return fmt::format("'{}' isn't expected at the start of the line", text[at]);
  return fmt::format("'{}' isn't expected after '{}'", text[at], text.substr(from, at - from));
}

std::size_t lineOf(std::string_view text, std::size_t taken) {
  const std::string_view before = text.substr(0, std::min(taken == 0 ? 0 : taken - 1, text.size()));
  return 1 + static_cast<std::size_t>(std::count(before.begin(), before.end(), '\n'));
}

}  // namespace vdi::io
