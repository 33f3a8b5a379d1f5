// JSON text for files that a run writes. It is concatenated from strings: the destructors of nlohmann's
// objects and lists allocate memory, and the process ends if that fails.
#pragma once

#include <concepts>
#include <string>
#include <string_view>
#include <vector>

namespace vdi::io {

/// These functions return a value's JSON. NaN and infinity are null.
std::string jsonOf(double number);
/// Bytes that are not UTF-8 become U+FFFD.
std::string jsonOf(std::string_view text);
template <std::integral Number>
std::string jsonOf(Number number) {
  return std::to_string(number);
}
/// A flag's function has a name of its own, because pointers to characters would convert to bool.
template <std::same_as<bool> Flag>
std::string jsonOf(Flag flag) = delete;
inline std::string jsonFlag(bool flag) {
  return flag ? "true" : "false";
}
/// The list of values that are JSON already.
std::string jsonListOf(const std::vector<std::string>& values);

/// A JSON object in one line, with its members in the order in which they were added.
class JsonObject {
 public:
  /// `value` is JSON already.
  JsonObject& add(std::string_view name, std::string_view value);
  std::string text() const { return "{" + members_ + "}"; }

 private:
  std::string members_;
};

}  // namespace vdi::io
