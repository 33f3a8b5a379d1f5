#include "vdi/config/FilePattern.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <string_view>
#include <system_error>

namespace vdi::config {

namespace {

constexpr const char* stepMark = "{timestep";

/// The digits of ":06d"; throws std::invalid_argument for other formats.
int digitsOf(const std::string& format) {
  constexpr int most = 20;
  char* after = nullptr;
  const bool isPadded = format.size() >= 4 && format.size() <= 5 && format[0] == ':' && format[1] == '0';
  const long digits = isPadded ? std::strtol(format.c_str() + 2, &after, 10) : 0;
  if (digits < 1 || digits > most || std::string(after) != "d")
    throw std::invalid_argument("the step's number is {timestep}, or {timestep:06d} with six digits");
  return static_cast<int>(digits);
}

/// The text as a number; nullopt if it isn't one, or has too many digits for a step.
std::optional<std::int64_t> stepOf(std::string_view text) {
  constexpr std::size_t mostDigits = 18;
  const std::size_t start = std::min(text.find_first_not_of('0'), text.size());
  const bool isNumber = !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
  if (!isNumber || text.size() - start > mostDigits) return std::nullopt;
  return std::strtoll(std::string(text).c_str(), nullptr, 10);
}

}  // namespace

FilePattern::FilePattern(const std::string& text) : text_(text) {
  const std::size_t start = text.find(stepMark);
  if (start == std::string::npos)
    throw std::invalid_argument(
        "must contain {timestep}, or {timestep:06d}: each frame has a file of its own");
  const std::size_t end = text.find('}', start);
  if (end == std::string::npos) throw std::invalid_argument("'}' is missing after {timestep");
  const std::size_t colon = start + std::string(stepMark).size();
  if (end > colon) digits_ = digitsOf(text.substr(colon, end - colon));
  std::string rest = text.substr(0, start) + text.substr(end + 1);
  for (const std::string_view mark : {cameraMark, fieldMark}) {
    const std::size_t at = rest.find(mark);
    if (at != std::string::npos) rest.erase(at, mark.size());
  }
  if (rest.find_first_of("{}") != std::string::npos)
    throw std::invalid_argument("only {timestep}, {camera} and {field} may appear in braces, once each");
  if (rest.find('\0') != std::string::npos || !path(0).has_filename())
    throw std::invalid_argument("isn't a file's name");
}

/// The text before the step's number, and the text after it.
std::pair<std::string, std::string> FilePattern::around(const std::string& camera,
                                                        const std::string& field) const {
  std::string text = text_;
  std::string added;
  if (!field.empty() && !namesField()) added += "_" + field;
  if (!camera.empty() && !namesCamera()) added += "_" + camera;
  const std::size_t name = text.find_last_of('/') == std::string::npos ? 0 : text.find_last_of('/') + 1;
  const std::size_t dot = text.find_last_of('.');
  const bool hasExtension =
      dot != std::string::npos && dot > name && text.find('}', dot) == std::string::npos;
  text.insert(hasExtension ? dot : text.size(), added);
  for (const auto& [mark, part] : {std::pair(fieldMark, field), std::pair(cameraMark, camera)}) {
    const std::size_t at = text.find(mark);
    if (at != std::string::npos) text.replace(at, mark.size(), part);
  }
  const std::size_t start = text.find(stepMark);
  return {text.substr(0, start), text.substr(text.find('}', start) + 1)};
}

std::string FilePattern::numberOf(std::int64_t step) const {
  return fmt::format("{:0{}}", step, digits_);
}

std::filesystem::path FilePattern::path(std::int64_t step, const std::string& camera,
                                        const std::string& field) const {
  const auto [front, back] = around(camera, field);
  return front + numberOf(step) + back;
}

std::optional<std::filesystem::path> FilePattern::firstExisting(const std::string& camera,
                                                                const std::string& field) const {
  // The step may be in a folder's name, so this searches for the part of the path with the number.
  const auto [front, back] = around(camera, field);
  const std::size_t slash = front.find_last_of('/');
  const std::string folder = slash == std::string::npos ? "." : front.substr(0, slash + 1);
  const std::string head = slash == std::string::npos ? front : front.substr(slash + 1);
  const std::string tail = back.substr(0, back.find('/'));
  std::optional<std::int64_t> lowest;
  std::error_code error;
  std::filesystem::directory_iterator entry(folder, error);
  for (; !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (name.size() <= head.size() + tail.size() || !name.starts_with(head) || !name.ends_with(tail))
      continue;
    const std::string number = name.substr(head.size(), name.size() - head.size() - tail.size());
    const std::optional<std::int64_t> step = stepOf(number);
    if (!step || number != numberOf(*step) || (lowest && *lowest <= *step)) continue;
    std::error_code ignored;
    if (std::filesystem::exists(std::filesystem::symlink_status(path(*step, camera, field), ignored)))
      lowest = step;
  }
  if (!lowest) return std::nullopt;
  return path(*lowest, camera, field);
}

}  // namespace vdi::config
