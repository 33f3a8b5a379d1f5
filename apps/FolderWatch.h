// Which .vdi files of a folder are new, found by looking again and again: that works on network file systems,
// where nobody is told of what other machines write.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace vdi::apps {

class FolderWatch {
 public:
  /// Throws Error{Io} for what isn't a folder that can be read.
  explicit FolderWatch(std::filesystem::path folder);

  /// Files named *.vdi that weren't there when this was called last, or have another size or another time
  /// since. In the order of their names, where numbers count as numbers. What begins with a dot is left out:
  /// io::writeAtomically may leave such. Throws Error{Io} while the folder can't be read.
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

/// "b2" before "b10".
bool comesBefore(const std::string& a, const std::string& b);

}  // namespace vdi::apps
