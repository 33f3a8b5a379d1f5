// Names of the files of a run's frames.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

namespace vdi::config {

/// A file's name with the step's number in it, as ParaView's extractors have it: "{timestep}", or
/// "{timestep:06d}" for six digits at least. "{camera}" stands for a camera's name; where it is missing,
/// names of cameras stand before the extension, after "_".
class FilePattern {
 public:
  /// Throws std::invalid_argument with the reason: not just one number, other braces, no file's name.
  explicit FilePattern(const std::string& text);

  bool namesCamera() const { return text_.find(cameraMark) != std::string::npos; }
  /// `camera` is empty for a run's only one, which then has no name in the pattern either.
  std::filesystem::path path(std::int64_t step, const std::string& camera = "") const;
  /// Of the files of this camera that exist, the one of the lowest step. Links, devices and folders of such a
  /// name count. What lies in a folder that can't be read doesn't.
  std::optional<std::filesystem::path> firstExisting(const std::string& camera = "") const;

 private:
  static constexpr const char* cameraMark = "{camera}";
  std::pair<std::string, std::string> around(const std::string& camera) const;
  std::string numberOf(std::int64_t step) const;

  std::string text_;  // all of it
  int digits_ = 1;
};

}  // namespace vdi::config
