// A JSON object in a file, read strictly: an unknown field is an error.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

namespace vdi::apps {

/// Reads the document in a file. Throws Error: Io if it cannot be read; Format if it is not JSON or
/// an object has two fields of one name. Both have the path as context.
nlohmann::json readJson(const std::filesystem::path& path);

class JsonFile {
 public:
  /// Throws Error as readJson does, and Error{Format} unless the text is one JSON object whose fields are all
  /// `known`.
  JsonFile(std::filesystem::path path, const std::set<std::string>& known);

  const std::filesystem::path& path() const { return path_; }
  bool has(const char* name) const { return object_.contains(name); }

  // Return the value of a field. Throw Error{Format} with the field's name if it is missing or has
  // another type.
  double number(const char* name) const;
  bool flag(const char* name) const;
  std::string text(const char* name) const;
  std::uint64_t count(const char* name) const;   // whole, >= 0
  glm::dvec3 vector(const char* name) const;     // three numbers
  glm::ivec3 positives(const char* name) const;  // three whole numbers >= 1
  /// One of `choices`.
  std::string choice(const char* name, const std::set<std::string>& choices) const;
  std::vector<double> numbers(const char* name) const;
  /// An array of rows of `width` numbers each.
  std::vector<std::vector<double>> rows(const char* name, std::size_t width) const;

  /// Throws Error{Format} with the path as context.
  [[noreturn]] void fail(const std::string& what) const;

 private:
  const nlohmann::json& at(const char* name) const;

  std::filesystem::path path_;
  nlohmann::json object_;
};

}  // namespace vdi::apps
