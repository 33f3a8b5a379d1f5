#include "vdi/io/JsonText.h"

#include <nlohmann/json.hpp>

namespace vdi::io {

namespace {

/// The JSON of a number or a string, whose destructors allocate nothing.
std::string dumped(const nlohmann::json& scalar) {
  return scalar.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

std::string jsonOf(double number) {
  return dumped(number);
}

std::string jsonOf(std::string_view text) {
  return dumped(text);
}

std::string jsonListOf(const std::vector<std::string>& values) {
  std::string list = "[";
  for (const std::string& value : values) {
    if (list.size() > 1) list += ',';
    list += value;
  }
  return list + ']';
}

JsonObject& JsonObject::add(std::string_view name, std::string_view value) {
  if (!members_.empty()) members_ += ',';
  members_ += jsonOf(name);
  members_ += ':';
  members_ += value;
  return *this;
}

}  // namespace vdi::io
