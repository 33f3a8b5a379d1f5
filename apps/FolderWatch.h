// Finds new .vdi files in a folder by listing it. The system says when to list a local folder; network file
// systems do not report what other machines write, so their folders must be listed repeatedly.
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
  ~FolderWatch();
  FolderWatch(const FolderWatch&) = delete;
  FolderWatch& operator=(const FolderWatch&) = delete;

  /// Becomes readable when this machine has changed the folder since the last call of changed(). -1 where the
  /// system has no more such watches to give (fs.inotify.max_user_instances).
  int descriptor() const { return descriptor_; }

  /// Files named *.vdi that are new since the last call, or have changed their size or time since. They are
  /// ordered by name, where numbers count as numbers. Names that begin with a dot are skipped:
  /// io::writeAtomically may leave such files. So are links to files of this folder. Throws Error{Io} while
  /// the folder cannot be read.
  std::vector<std::filesystem::path> changed();

 private:
  struct Look {
    std::uintmax_t size;
    std::filesystem::file_time_type time;
    bool operator==(const Look&) const = default;
  };
  void watch() const;

  std::filesystem::path folder_;
  int descriptor_;
  std::map<std::filesystem::path, Look> known_;
};

/// Orders "b2" before "b10".
bool comesBefore(const std::string& a, const std::string& b);

}  // namespace vdi::apps
