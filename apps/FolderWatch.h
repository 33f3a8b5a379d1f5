// Finds new .vdi files in a folder by listing it. The system reports changes of a local folder.
// Network file systems don't report files from other machines, so their folders must be listed
// repeatedly.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "vdi/core/Descriptor.h"

namespace vdi::apps {

/// Properties that reveal a change of a file without reading it.
struct FileLook {
  std::uintmax_t size = 0;
  std::filesystem::file_time_type time;
  bool operator==(const FileLook&) const = default;
};
/// The file's properties; nullopt if the file is gone.
std::optional<FileLook> lookAt(const std::filesystem::path& file);

class FolderWatch {
 public:
  /// Throws Error{Io} for anything but a readable folder.
  explicit FolderWatch(std::filesystem::path folder);

  /// Becomes readable when this machine has changed the folder since the last call of changed(). -1
  /// if the system has no watches left (fs.inotify.max_user_instances).
  int descriptor() const { return descriptor_.number(); }

  struct Changes {
    std::vector<std::filesystem::path> files;  // that are new, or whose size or time has changed
    std::vector<std::filesystem::path> gone;   // that were there before
  };
  /// Returns the changes of the files named *.vdi since the last call. `files` are ordered by name,
  /// with numbers compared as numbers. Names that begin with a dot are skipped, because
  /// io::writeAtomically may leave such files. Links to files of this folder are skipped, too. Throws
  /// Error{Io} while the folder can't be read.
  Changes changed();

 private:
  void watch() const;

  std::filesystem::path folder_;
  Descriptor descriptor_;
  std::map<std::filesystem::path, FileLook> known_;
};

/// Orders "b2" before "b10".
bool comesBefore(const std::string& a, const std::string& b);

}  // namespace vdi::apps
