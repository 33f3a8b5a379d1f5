#include "vdi/io/Files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/magic.h>
#include <sys/stat.h>
#include <sys/statfs.h>
#include <unistd.h>

#include <cassert>
#include <cerrno>
#include <csignal>
#include <optional>
#include <random>
#include <system_error>
#include <utility>

#include "vdi/core/Error.h"

namespace vdi::io {

namespace {

namespace fs = std::filesystem;
using Status = struct stat;

[[noreturn]] void fail(const char* what, int error, const fs::path& path) {
  throw Error(ErrorCode::Io, fmt::format("can't {}: {}", what, std::generic_category().message(error)),
              path.string());
}

const char* kindOf(mode_t mode) {
  if (S_ISDIR(mode)) return "a folder";
  if (S_ISFIFO(mode)) return "a pipe";
  if (S_ISSOCK(mode)) return "a socket";
  return S_ISBLK(mode) ? "a block device" : "a device";
}

/// A file descriptor that is closed at the end; -1 for none.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  explicit operator bool() const { return number_ >= 0; }
  int get() const { return number_; }
  /// Returns close's result.
  int close() { return ::close(std::exchange(number_, -1)); }

 private:
  int number_;
};

/// A reader that leaves its pipe is an error of the write, not the end of this process.
class PipeSignalBlocked {
 public:
  PipeSignalBlocked() {
    ::sigemptyset(&pipe_);
    ::sigaddset(&pipe_, SIGPIPE);
    ::pthread_sigmask(SIG_BLOCK, &pipe_, &before_);
  }
  ~PipeSignalBlocked() {
    if (::sigismember(&before_, SIGPIPE) == 0) {
      const timespec now{};
      while (::sigtimedwait(&pipe_, nullptr, &now) > 0) {
      }
    }
    ::pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  PipeSignalBlocked(const PipeSignalBlocked&) = delete;
  PipeSignalBlocked& operator=(const PipeSignalBlocked&) = delete;

 private:
  sigset_t pipe_{};
  sigset_t before_{};
};

void writeTo(int descriptor, std::span<const std::byte> bytes, const fs::path& path) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail("write the file", errno, path);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
}

/// The file that a chain of symbolic links ends at; it may not exist.
fs::path followLinks(const fs::path& path) {
  fs::path at = path;
  std::error_code error;
  for (fs::path next = fs::read_symlink(at, error); !error; next = fs::read_symlink(at, error)) {
    struct statfs system {};
    const fs::path folder = at.has_parent_path() ? at.parent_path() : ".";
    if (::statfs(folder.c_str(), &system) == 0 && system.f_type == PROC_SUPER_MAGIC) {
      throw Error(ErrorCode::Io, "it stands for a file that is already open; name that file", path.string());
    }
    at = folder / next;
  }
  return at;
}

/// Where what's written to a path goes.
struct Destination {
  fs::path path;                 // as it was named
  fs::path file;                 // links followed; equal to path if `through`
  std::optional<Status> status;  // none: there's no such file yet
  bool through = false;          // a device or pipe: written to as it is

  explicit Destination(fs::path named) : path(std::move(named)), file(path) {
    Status found{};
    if (::stat(path.c_str(), &found) == 0) {
      status = found;
    } else if (errno != ENOENT) {
      fail("write the file", errno, path);
    }
    if (!path.has_filename()) throw Error(ErrorCode::Io, "it has no file name", path.string());
    through = status && (S_ISCHR(status->st_mode) || S_ISFIFO(status->st_mode));
    if (status && !through && !S_ISREG(status->st_mode)) {
      throw Error(ErrorCode::Io, fmt::format("can't write {}", kindOf(status->st_mode)), path.string());
    }
    if (!through) file = followLinks(path);
  }
  fs::path folder() const { return file.has_parent_path() ? file.parent_path() : "."; }
};

void requireAccess(const fs::path& file, int mode, const char* what, const fs::path& path) {
  if (::faccessat(AT_FDCWD, file.c_str(), mode, AT_EACCESS) != 0) fail(what, errno, path);
}

void requireWritable(const Destination& to) {
  if (to.status) requireAccess(to.file, W_OK, "write the file", to.path);
  if (!to.through) requireAccess(to.folder(), W_OK | X_OK, "write into the folder", to.path);
}

void writeThrough(const Destination& to, std::span<const std::byte> bytes) {
  // Not blocking: a pipe without a reader is refused, not waited for.
  Descriptor file(::open(to.path.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK));
  if (!file && errno == ENXIO) throw Error(ErrorCode::Io, "nobody reads from the pipe", to.path.string());
  if (!file) fail("open the file", errno, to.path);
  const int flags = ::fcntl(file.get(), F_GETFL);
  if (flags < 0 || ::fcntl(file.get(), F_SETFL, flags & ~O_NONBLOCK) != 0) {
    fail("open the file", errno, to.path);
  }
  const PipeSignalBlocked blocked;
  writeTo(file.get(), bytes, to.path);
  if (file.close() != 0) fail("write the file", errno, to.path);
}

/// A name in the folder that nobody uses. Process numbers repeat between the nodes of a cluster that share a
/// file system, so it has a random part; it's short, for the file's own name may be as long as names can be.
fs::path temporaryName(const Destination& to) {
  std::random_device random;
  return to.folder() / fmt::format(".vdi-{}-{:08x}{:08x}.tmp", ::getpid(), random(), random());
}

/// Writes the bytes, gives the file the permissions of the one that it replaces, and waits for the disk.
void fill(int descriptor, const Destination& to, std::span<const std::byte> bytes) {
  writeTo(descriptor, bytes, to.path);
  if (to.status) {
    // Only root may give files away; for others the file becomes their own.
    static_cast<void>(::fchown(descriptor, to.status->st_uid, to.status->st_gid) == 0);
    if (::fchmod(descriptor, to.status->st_mode & 07777U) != 0) fail("set permissions", errno, to.path);
  }
  if (::fsync(descriptor) != 0) fail("write the file", errno, to.path);
}

/// The other name of a file until it's renamed.
class TemporaryName {
 public:
  TemporaryName(fs::path name, const Destination& to) : name_(std::move(name)), to_(to) {}
  ~TemporaryName() {
    if (!name_.empty()) ::unlink(name_.c_str());
  }
  TemporaryName(const TemporaryName&) = delete;
  TemporaryName& operator=(const TemporaryName&) = delete;
  void rename() {
    if (::rename(name_.c_str(), to_.file.c_str()) != 0) fail("replace the file", errno, to_.path);
    name_.clear();
  }

 private:
  fs::path name_;
  const Destination& to_;
};

bool giveName(int descriptor, const fs::path& name) {
  const std::string file = fmt::format("/proc/self/fd/{}", descriptor);
  return ::linkat(AT_FDCWD, file.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0;
}

/// By a file that has no name until it's complete. False, and nothing done, where there are none.
bool replaceByUnnamed(const Destination& to, std::span<const std::byte> bytes) {
  const Descriptor file(::open(to.folder().c_str(), O_WRONLY | O_TMPFILE | O_CLOEXEC, 0666));
  if (!file) return false;
  fill(file.get(), to, bytes);
  if (!to.status && giveName(file.get(), to.file)) return true;
  // A link replaces nothing, a renamed file does.
  fs::path name;
  do {
    name = temporaryName(to);
    if (giveName(file.get(), name)) {
      TemporaryName(name, to).rename();
      return true;
    }
  } while (errno == EEXIST);
  return false;
}

void replaceByNamed(const Destination& to, std::span<const std::byte> bytes) {
  fs::path name;
  int descriptor = -1;
  do {
    name = temporaryName(to);
    descriptor = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  } while (descriptor < 0 && errno == EEXIST);
  if (descriptor < 0) fail("create the file", errno, to.path);
  TemporaryName temporary(name, to);
  Descriptor file(descriptor);
  fill(file.get(), to, bytes);
  if (file.close() != 0) fail("write the file", errno, to.path);
  temporary.rename();
}

/// So that the new name survives a power cut. File systems that can't do this say so by other errors.
void synchronizeFolder(const Destination& to) {
  const Descriptor folder(::open(to.folder().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder && ::fsync(folder.get()) != 0 && errno == EIO) fail("write the folder", errno, to.path);
}

}  // namespace

InputFile::InputFile(fs::path path)
    // Not blocking: a pipe without a writer is refused below, not waited for.
    : path_(std::move(path)),
      descriptor_(::open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK)) {
  if (descriptor_ < 0) fail("open the file", errno, path_);
  Status status{};
  const bool known = ::fstat(descriptor_, &status) == 0;
  if (!known || !S_ISREG(status.st_mode)) {
    ::close(descriptor_);
    throw Error(
        ErrorCode::Io,
        fmt::format("not a regular file{}", known ? fmt::format(" but {}", kindOf(status.st_mode)) : ""),
        path_.string());
  }
  size_ = static_cast<std::uint64_t>(status.st_size);
}

InputFile::~InputFile() {
  ::close(descriptor_);
}

void InputFile::readInto(std::uint64_t offset, std::span<std::byte> to) const {
  while (!to.empty()) {
    const ssize_t got = ::pread(descriptor_, to.data(), to.size(), static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail("read the file", errno, path_);
    if (got == 0) throw Error(ErrorCode::Io, "the file became shorter while it was read", path_.string());
    offset += static_cast<std::uint64_t>(got);
    to = to.subspan(static_cast<std::size_t>(got));
  }
}

std::vector<std::byte> InputFile::read(std::uint64_t offset, std::uint64_t count) const {
  assert(offset <= size_ && count <= size_ - offset);
  std::vector<std::byte> bytes(count);
  readInto(offset, bytes);
  return bytes;
}

void writeAtomically(const fs::path& path, std::span<const std::byte> bytes) {
  const Destination to(path);
  requireWritable(to);
  if (to.through) {
    writeThrough(to, bytes);
    return;
  }
  if (!replaceByUnnamed(to, bytes)) replaceByNamed(to, bytes);
  synchronizeFolder(to);
}

fs::path requireWritable(const fs::path& path) {
  const Destination to(path);
  requireWritable(to);
  return to.through ? fs::path() : fs::canonical(to.folder()) / to.file.filename();
}

}  // namespace vdi::io
