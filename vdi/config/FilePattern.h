// The pattern of the names of a run's files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace vdi::config {

/// A file's name with the step's number in it, in the syntax of ParaView's extractors: "{timestep}", or
/// "{timestep:06d}" for at least six digits. "{camera}" and "{field}" become the camera's and the field's
/// name. Names without a place in the pattern come before the extension, each after "_", the field's first.
class FilePattern {
 public:
  /// Throws std::invalid_argument with the reason if there isn't exactly one number, there are other braces,
  /// or the path has no file's name.
  explicit FilePattern(const std::string& text);

  bool namesCamera() const { return text_.find(cameraMark) != std::string::npos; }
  bool namesField() const { return text_.find(fieldMark) != std::string::npos; }
  /// `camera` is empty if the run has a single, unnamed camera; the pattern then has no {camera}. The same
  /// holds for the field.
  std::filesystem::path path(std::int64_t step, const std::string& camera = "",
                             const std::string& field = "") const;
  /// The existing file of this camera and field with the lowest step. Links, devices and folders with such
  /// names count. Files in an unreadable folder don't.
  std::optional<std::filesystem::path> firstExisting(const std::string& camera = "",
                                                     const std::string& field = "") const;

 private:
  static constexpr std::string_view cameraMark = "{camera}";
  static constexpr std::string_view fieldMark = "{field}";
  std::pair<std::string, std::string> around(const std::string& camera, const std::string& field) const;
  std::string numberOf(std::int64_t step) const;

  std::string text_;  // the whole pattern
  int digits_ = 1;
};

}  // namespace vdi::config
