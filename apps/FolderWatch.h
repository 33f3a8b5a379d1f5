// Finds new .vdi files in a folder. The system reports changes that this machine makes. Network file
// systems don't report files from other machines, so folders are listed from time to time, too.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "vdi/core/Descriptor.h"

namespace vdi::apps {

/// Properties that reveal a change of a file without reading it.
struct FileLook {
  std::uint64_t size = 0;
  std::int64_t seconds = 0;  // of the last change
  std::int64_t nanoseconds = 0;
  bool operator==(const FileLook&) const = default;
};
/// The file's properties; nullopt if the file is gone, or isn't a regular file.
std::optional<FileLook> lookAt(const std::filesystem::path& file);

class FolderWatch {
 public:
  /// Throws Error{Io} for anything but a readable folder.
  explicit FolderWatch(std::filesystem::path folder);

  /// Becomes readable when this machine has changed the folder since the last call of changed(). -1
  /// if the system has no watches left (fs.inotify.max_user_instances).
  int descriptor() const { return descriptor_.number(); }
  /// The time until changed() lists the folder although the system reports nothing: at least 250
  /// ms, and no more than a minute. In between, it grows with the time that listing takes, so that
  /// listing takes 2 % of the time.
  std::chrono::milliseconds untilListing() const;

  struct Changes {
    std::vector<std::filesystem::path> files;  // new files, and those whose size or time has changed
    std::vector<std::filesystem::path> gone;   // files that no longer exist
  };
  /// Returns the changes of the files named *.vdi since the last call. `files` are ordered by name,
  /// with numbers compared as numbers. Names that begin with a dot are skipped, because
  /// io::writeAtomically may leave such files. Links to files of this folder are skipped, too. Throws
  /// Error{Io} while the folder can't be read.
  Changes changed();

 private:
  bool watch();
  bool readReported(std::set<std::string>& names) const;
  void list(Changes& changes);
  void check(const std::string& name, Changes& changes);
  bool isKnown(const std::string& name, const FileLook& look) const;

  std::filesystem::path folder_;
  Descriptor descriptor_;
  int number_ = -1;  // of the watch; -1: none
  std::chrono::steady_clock::time_point nextListing_;
  std::map<std::string, FileLook> known_;  // by name
};

/// Orders "b2" before "b10".
bool comesBefore(const std::string& a, const std::string& b);

}  // namespace vdi::apps
