#include "vdi/stream/SecretFile.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

#include "vdi/core/Error.h"

namespace vdi::stream {

SecretFile::SecretFile(std::string path, const std::string& line) : path_(std::move(path)) {
  constexpr mode_t ownerOnly = 0600;
  const std::string part = fmt::format("{}.{}.part", path_, ::getpid());
  (void)::unlink(part.c_str());
  const int file = ::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, ownerOnly);
  const std::string text = line + "\n";
  const bool isWritten =
      file >= 0 && ::write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  int error = isWritten ? 0 : errno;
  if (file >= 0) ::close(file);
  if (error == 0 && std::rename(part.c_str(), path_.c_str()) != 0) error = errno;
  if (error == 0) return;
  (void)::unlink(part.c_str());
  throw Error(ErrorCode::Io, std::string("can't write the link: ") + std::strerror(error), path_);
}

SecretFile::~SecretFile() {
  (void)::unlink(path_.c_str());
}

}  // namespace vdi::stream
