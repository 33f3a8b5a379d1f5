#include "apps/Help.h"

#include <charconv>
#include <cstdint>
#include <sstream>
#include <system_error>

namespace vdi::apps {

namespace {

constexpr std::size_t nameColumn = 30;
constexpr std::size_t textWidth = 74;

/// Breaks lines at blanks. A continued line is indented like its first line.
std::string wrapped(const std::string& line) {
  const std::size_t first = line.find_first_not_of(' ');
  const std::string indent(first == std::string::npos ? 0 : first, ' ');
  std::stringstream words(line);
  std::string text = indent;
  std::size_t used = indent.size();
  bool atStart = true;
  for (std::string word; words >> word; atStart = false) {
    if (!atStart && used + 1 + word.size() > textWidth) {
      text += "\n" + indent;
      used = indent.size();
    } else if (!atStart) {
      text += ' ';
      ++used;
    }
    text += word;
    used += word.size();
  }
  return text;
}

}  // namespace

HelpFormatter::HelpFormatter() {
  column_width(nameColumn);
}

std::string HelpFormatter::make_option_opts(const CLI::Option* option) const {
  std::string text;
  const std::string type = option->get_type_name();
  if (!type.empty()) text += " " + type;
  if (!option->get_default_str().empty()) text += " = " + option->get_default_str();
  if (option->get_expected_max() == CLI::detail::expected_max_vector_size) text += " ...";
  if (option->get_required()) text += " (required)";
  return text;
}

std::string HelpFormatter::make_option_desc(const CLI::Option* option) const {
  std::stringstream lines(option->get_description());
  std::string text;
  for (std::string line; std::getline(lines, line);) text += (text.empty() ? "" : "\n") + wrapped(line);
  return text;
}

std::string requirePositive(const std::string& text) {
  double value = 0.0;
  return CLI::detail::lexical_cast(text, value) && value > 0.0 ? "" : "must be > 0, but is " + text;
}

std::string requireFileName(const std::string& text) {
  return text.empty() ? "must name a file" : "";
}

std::string requireWholeNumber(const std::string& text) {
  std::uint64_t value = 0;
  const char* const end = text.data() + text.size();
  const auto [after, error] = std::from_chars(text.data(), end, value);
  const bool good = error == std::errc() && after == end;
  return good ? "" : "must be a whole number from 0 to 2^64 - 1, but is " + text;
}

}  // namespace vdi::apps
