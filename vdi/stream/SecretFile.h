// A file with a secret in it.
#pragma once

#include <sys/types.h>

#include <string>

namespace vdi::stream {

/// A file that only its owner can read. It exists as long as this object, unless another process replaces it:
/// a file that isn't this object's stays.
class SecretFile {
 public:
  /// Replaces a file of that name, in the working directory as it is now if the path is relative. Throws
  /// Error{Io} with the path as context if it can't be written.
  SecretFile(const std::string& path, const std::string& line);
  ~SecretFile();
  SecretFile(const SecretFile&) = delete;
  SecretFile& operator=(const SecretFile&) = delete;

 private:
  std::string path_;  // absolute
  dev_t device_ = 0;
  ino_t inode_ = 0;
};

}  // namespace vdi::stream
