// A file with a secret in it.
#pragma once

#include <string>

namespace vdi::stream {

/// A file that only its owner can read. It exists as long as this object.
class SecretFile {
 public:
  /// Replaces a file of that name. Throws Error{Io} with the path as context if it can't be written.
  SecretFile(std::string path, const std::string& line);
  ~SecretFile();
  SecretFile(const SecretFile&) = delete;
  SecretFile& operator=(const SecretFile&) = delete;

 private:
  std::string path_;
};

}  // namespace vdi::stream
