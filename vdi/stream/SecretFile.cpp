#include "vdi/stream/SecretFile.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "vdi/core/Error.h"

namespace vdi::stream {

namespace {

std::string absolutePath(const std::string& path) {
  std::error_code error;
  const std::filesystem::path whole = std::filesystem::absolute(path, error);
  if (error) throw Error(ErrorCode::Io, "can't write the link: " + error.message(), path);
  return whole.string();
}

}  // namespace

SecretFile::SecretFile(const std::string& path, const std::string& line) : path_(absolutePath(path)) {
  constexpr mode_t ownerOnly = 0600;
  const std::string part = fmt::format("{}.{}.part", path_, ::getpid());
  (void)::unlink(part.c_str());
  const int file = ::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, ownerOnly);
  const std::string text = line + "\n";
  struct stat status {};
  const bool isWritten = file >= 0 &&
                         ::write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
                         ::fstat(file, &status) == 0;
  int error = isWritten ? 0 : errno;
  if (file >= 0) ::close(file);
  device_ = status.st_dev;
  inode_ = status.st_ino;
  if (error == 0 && std::rename(part.c_str(), path_.c_str()) != 0) error = errno;
  if (error == 0) return;
  (void)::unlink(part.c_str());
  throw Error(ErrorCode::Io, std::string("can't write the link: ") + std::strerror(error), path);
}

SecretFile::~SecretFile() {
  struct stat status {};
  const bool isOwn =
      ::lstat(path_.c_str(), &status) == 0 && status.st_dev == device_ && status.st_ino == inode_;
  if (isOwn) (void)::unlink(path_.c_str());
}

}  // namespace vdi::stream
