// Finds new .vdi files in a folder by listing it repeatedly. This works on network file systems, which do not
// report what other machines write.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace vdi::apps {

class FolderWatch {
 public:
  /// Throws Error{Io} for anything but a readable folder.
  explicit FolderWatch(std::filesystem::path folder);

  /// Files named *.vdi that are new since the last call, or have changed their size or time since. They are
  /// ordered by name, where numbers count as numbers. Names that begin with a dot are skipped:
  /// io::writeAtomically may leave such files. Throws Error{Io} while the folder cannot be read.
  std::vector<std::filesystem::path> changed();

 private:
  struct Look {
    std::uintmax_t size;
    std::filesystem::file_time_type time;
    bool operator==(const Look&) const = default;
  };
  std::filesystem::path folder_;
  std::map<std::filesystem::path, Look> known_;
};

/// Orders "b2" before "b10".
bool comesBefore(const std::string& a, const std::string& b);

}  // namespace vdi::apps
