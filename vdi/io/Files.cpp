#include "vdi/io/Files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <random>
#include <system_error>
#include <utility>

#include "vdi/core/Error.h"

namespace vdi::io {

namespace {

[[noreturn]] void fail(const char* what, int error, const std::filesystem::path& path) {
  throw Error(ErrorCode::Io, fmt::format("can't {}: {}", what, std::generic_category().message(error)),
              path.string());
}

/// The other name, and its file until it's renamed.
class TemporaryFile {
 public:
  /// Process numbers repeat between the nodes of a cluster that share a file system, so the name has a random
  /// part.
  explicit TemporaryFile(const std::filesystem::path& target) : target_(target) {
    std::random_device random;
    do {
      path_ = target.string() + fmt::format(".{}-{:08x}.tmp", ::getpid(), random());
      descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    } while (descriptor_ < 0 && errno == EEXIST);
    if (descriptor_ < 0) fail("create the file", errno, target_);
  }
  ~TemporaryFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (!path_.empty()) ::unlink(path_.c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  void write(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
      const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) fail("write the file", errno, target_);
      bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
  }
  void commit() {
    if (::close(std::exchange(descriptor_, -1)) != 0) fail("write the file", errno, target_);
    if (::rename(path_.c_str(), target_.c_str()) != 0) fail("replace the file", errno, target_);
    path_.clear();
  }

 private:
  const std::filesystem::path& target_;
  std::filesystem::path path_;
  int descriptor_ = -1;
};

}  // namespace

InputFile::InputFile(std::filesystem::path path)
    // Not blocking: a pipe without a writer is refused below, not waited for.
    : path_(std::move(path)), descriptor_(::open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
  if (descriptor_ < 0) fail("open the file", errno, path_);
  struct stat status {};
  const bool known = ::fstat(descriptor_, &status) == 0;
  if (!known || !S_ISREG(status.st_mode)) {
    ::close(descriptor_);
    throw Error(ErrorCode::Io, "not a regular file", path_.string());
  }
  size_ = static_cast<std::uint64_t>(status.st_size);
}

InputFile::~InputFile() {
  ::close(descriptor_);
}

std::vector<std::byte> InputFile::read(std::uint64_t offset, std::uint64_t count) const {
  assert(offset <= size_ && count <= size_ - offset);
  std::vector<std::byte> bytes(count);
  for (std::uint64_t done = 0; done < count;) {
    const ssize_t got =
        ::pread(descriptor_, bytes.data() + done, count - done, static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail("read the file", errno, path_);
    if (got == 0) throw Error(ErrorCode::Io, "the file became shorter while it was read", path_.string());
    done += static_cast<std::uint64_t>(got);
  }
  return bytes;
}

void writeAtomically(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  TemporaryFile file(path);
  file.write(bytes);
  file.commit();
}

}  // namespace vdi::io
