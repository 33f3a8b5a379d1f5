#include "apps/JsonFile.h"

#include <fmt/format.h>
#include <fmt/ranges.h>  // fmt::join

#include <limits>
#include <string_view>
#include <utility>

#include "vdi/core/Error.h"
#include "vdi/io/Files.h"
#include "vdi/io/JsonFault.h"

namespace vdi::apps {

using nlohmann::json;

namespace {

bool isNumbers(const json& value, std::size_t count) {
  if (!value.is_array() || value.size() != count) return false;
  for (const json& item : value) {
    if (!item.is_number()) return false;
  }
  return true;
}

}  // namespace

json readJson(const std::filesystem::path& path) {
  const auto fail = [&](const std::string& what) { throw Error(ErrorCode::Format, what, path.string()); };
  const io::InputFile file(path);
  // a larger file is probably a picture or volume, given by mistake
  constexpr std::uint64_t maxBytes = std::uint64_t{256} << 20;
  if (file.size() > maxBytes) fail(fmt::format("{} bytes are too many for JSON", file.size()));
  const std::vector<std::byte> bytes = file.readAll();
  std::vector<std::set<std::string>> open;  // the names so far in each unfinished object
  const auto noteNames = [&](int, json::parse_event_t event, const json& value) {
    if (event == json::parse_event_t::object_start) open.emplace_back();
    if (event == json::parse_event_t::object_end) open.pop_back();
    if (event == json::parse_event_t::key && !open.back().insert(value.get<std::string>()).second) {
      fail(fmt::format("the field '{}' occurs twice", value.get<std::string>()));
    }
    return true;
  };
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  try {
    return json::parse(text.begin(), text.end(), noteNames);
  } catch (const json::parse_error& error) {
    fail(fmt::format("line {}: not valid JSON: {}", io::lineOf(text, error.byte),
                     io::jsonFault(text, error.byte, error.id)));
  } catch (const json::exception& error) {  // a number that overflows
    fail("not valid JSON: " + io::jsonFault(text, text.size(), error.id));
  }
  return {};
}

JsonFile::JsonFile(std::filesystem::path path, const std::set<std::string>& known)
    : path_(std::move(path)), object_(readJson(path_)) {
  if (!object_.is_object()) fail("not a JSON object");
  for (const auto& [key, value] : object_.items()) {
    if (!known.contains(key))
      fail(fmt::format("unknown field '{}'; known fields are {}", key, fmt::join(known, ", ")));
  }
}

double JsonFile::number(const char* name) const {
  const json& value = at(name);
  if (!value.is_number()) fail(fmt::format("'{}' must be a number", name));
  return value.get<double>();
}

bool JsonFile::flag(const char* name) const {
  const json& value = at(name);
  if (!value.is_boolean()) fail(fmt::format("'{}' must be true or false", name));
  return value.get<bool>();
}

std::string JsonFile::text(const char* name) const {
  const json& value = at(name);
  if (!value.is_string()) fail(fmt::format("'{}' must be a string", name));
  return value.get<std::string>();
}

std::uint64_t JsonFile::count(const char* name) const {
  const json& value = at(name);
  if (!value.is_number_unsigned()) fail(fmt::format("'{}' must be a whole number >= 0", name));
  return value.get<std::uint64_t>();
}

glm::dvec3 JsonFile::vector(const char* name) const {
  const json& value = at(name);
  if (!isNumbers(value, 3)) fail(fmt::format("'{}' must be three numbers", name));
  return {value[0].get<double>(), value[1].get<double>(), value[2].get<double>()};
}

glm::ivec3 JsonFile::positives(const char* name) const {
  const json& value = at(name);
  glm::ivec3 result(0);
  bool good = isNumbers(value, 3);
  for (int axis = 0; good && axis < 3; ++axis) {
    const json& item = value[static_cast<std::size_t>(axis)];
    good = item.is_number_unsigned() && item.get<std::uint64_t>() >= 1 &&
           item.get<std::uint64_t>() <= static_cast<std::uint64_t>(std::numeric_limits<int>::max());
    if (good) result[axis] = item.get<int>();
  }
  if (!good) fail(fmt::format("'{}' must be three whole numbers >= 1", name));
  return result;
}

std::string JsonFile::choice(const char* name, const std::set<std::string>& choices) const {
  std::string value = text(name);
  if (!choices.contains(value)) {
    fail(fmt::format("'{}' must be one of {}, but is '{}'", name, fmt::join(choices, ", "), value));
  }
  return value;
}

std::vector<double> JsonFile::numbers(const char* name) const {
  const json& value = at(name);
  if (!value.is_array() || !isNumbers(value, value.size()))
    fail(fmt::format("'{}' must be a list of numbers", name));
  return value.get<std::vector<double>>();
}

std::vector<std::vector<double>> JsonFile::rows(const char* name, std::size_t width) const {
  const json& value = at(name);
  const auto require = [&](bool good) {
    if (!good) fail(fmt::format("'{}' must be a list of lists of {} numbers", name, width));
  };
  require(value.is_array());
  std::vector<std::vector<double>> rows;
  for (const json& row : value) {
    require(isNumbers(row, width));
    rows.push_back(row.get<std::vector<double>>());
  }
  return rows;
}

void JsonFile::fail(const std::string& what) const {
  throw Error(ErrorCode::Format, what, path_.string());
}

const json& JsonFile::at(const char* name) const {
  if (!has(name)) fail(fmt::format("the field '{}' is missing", name));
  return object_.at(name);
}

}  // namespace vdi::apps
