// A file that contains a secret.
#pragma once

#include <sys/types.h>

#include <string>

namespace vdi::stream {

/// A file that only its owner can read. The destructor removes it, unless another process has replaced it.
class SecretFile {
 public:
  /// Replaces the file at `path`, which may be relative to the present working directory. Throws Error{Io}
  /// with the path as context if it can't be written.
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
