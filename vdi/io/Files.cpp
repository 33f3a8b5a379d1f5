#include "vdi/io/Files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/magic.h>
#include <sys/stat.h>
#include <sys/statfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <optional>
#include <random>
#include <system_error>
#include <utility>

#include "vdi/core/Descriptor.h"
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

/// Blocks SIGPIPE, so that a write to a closed pipe fails instead of ending the process.
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

void writeTo(int descriptor, std::uint64_t offset, std::span<const std::byte> bytes, const fs::path& path) {
  while (!bytes.empty()) {
    const ssize_t written = ::pwrite(descriptor, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail("write the file", errno, path);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
    offset += static_cast<std::uint64_t>(written);
  }
}

/// The file at the end of a chain of symbolic links; it need not exist.
fs::path followLinks(const fs::path& path) {
  fs::path at = path;
  std::error_code error;
  for (fs::path next = fs::read_symlink(at, error); !error; next = fs::read_symlink(at, error)) {
    struct statfs system {};
    const fs::path folder = at.has_parent_path() ? at.parent_path() : ".";
    if (::statfs(folder.c_str(), &system) == 0 && system.f_type == PROC_SUPER_MAGIC) {
      throw Error(ErrorCode::Io, "the path is an alias of an open file; name that file", path.string());
    }
    at = folder / next;
  }
  return at;
}

/// The target of a write to a path.
struct Destination {
  fs::path path;                 // as the caller named it
  fs::path file;                 // links followed; equal to path if `through`
  std::optional<Status> status;  // none: the file does not exist yet
  bool through = false;          // a device or pipe, which is written directly

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

/// Opens a device or pipe.
Descriptor openAsItIs(const fs::path& path) {
  // Non-blocking: a pipe without a reader is refused, not waited for.
  Descriptor file(::open(path.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK));
  if (!file.isOpen() && errno == ENXIO)
    throw Error(ErrorCode::Io, "nobody reads from the pipe", path.string());
  if (!file.isOpen()) fail("open the file", errno, path);
  const int flags = ::fcntl(file.number(), F_GETFL);
  if (flags < 0 || ::fcntl(file.number(), F_SETFL, flags & ~O_NONBLOCK) != 0)
    fail("open the file", errno, path);
  return file;
}

/// An unused name in the folder. It has a random part, because process numbers repeat between the nodes of a
/// cluster that share a file system. It is short, because the file's own name may have the greatest possible
/// length.
fs::path temporaryName(const fs::path& folder) {
  std::random_device random;
  return folder / fmt::format(".vdi-{}-{:08x}{:08x}.tmp", ::getpid(), random(), random());
}

bool giveName(int descriptor, const fs::path& name) {
  const std::string file = fmt::format("/proc/self/fd/{}", descriptor);
  return ::linkat(AT_FDCWD, file.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0;
}

/// Copies a file on systems where an unnamed one can't get a name, for example without /proc.
void copyAll(int from, int to, const fs::path& path) {
  std::vector<std::byte> buffer(std::size_t{1} << 20);
  for (std::uint64_t at = 0;;) {
    const ssize_t got = ::pread(from, buffer.data(), buffer.size(), static_cast<off_t>(at));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail("read back the file", errno, path);
    if (got == 0) return;
    writeTo(to, at, std::span(buffer).first(static_cast<std::size_t>(got)), path);
    at += static_cast<std::uint64_t>(got);
  }
}

/// Makes the new name survive a power cut. File systems that cannot do this report other errors.
void synchronizeFolder(const Destination& to) {
  const Descriptor folder(::open(to.folder().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder.isOpen() && ::fsync(folder.number()) != 0 && errno == EIO)
    fail("write the folder", errno, to.path);
}

}  // namespace

InputFile::InputFile(fs::path path)
    // Non-blocking: a pipe without a writer is refused below, not waited for.
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

struct OutputFile::State {
  Destination to;
  Descriptor file;
  fs::path name;  // its temporary name; empty while the file has none

  explicit State(const fs::path& path) : to(path) {
    requireWritable(to);
    if (to.through) {
      file = openAsItIs(to.path);
      return;
    }
    file = Descriptor(::open(to.folder().c_str(), O_RDWR | O_TMPFILE | O_CLOEXEC, 0666));
    if (!file.isOpen()) file = createNamed();
  }
  ~State() {
    if (!name.empty()) ::unlink(name.c_str());
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  State(State&&) = delete;
  State& operator=(State&&) = delete;

  Descriptor createNamed() {
    fs::path candidate;
    Descriptor made;
    do {
      candidate = temporaryName(to.folder());
      made = Descriptor(::open(candidate.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
    } while (!made.isOpen() && errno == EEXIST);
    if (!made.isOpen()) fail("create the file", errno, to.path);
    name = candidate;
    return made;
  }

  /// Other processes open the file by its name, and only a rename, not a link, can replace another file.
  void requireName() {
    if (!name.empty()) return;
    fs::path candidate;
    bool named = false;
    do {
      candidate = temporaryName(to.folder());
      named = giveName(file.number(), candidate);
    } while (!named && errno == EEXIST);
    if (named) {
      name = candidate;
      return;
    }
    Descriptor other = createNamed();
    copyAll(file.number(), other.number(), to.path);
    file = std::move(other);
  }

  /// Takes the permissions of the file that it replaces.
  void takePermissions() {
    if (!to.status) return;
    // Only root may give files away; otherwise the file belongs to this process's user.
    static_cast<void>(::fchown(file.number(), to.status->st_uid, to.status->st_gid) == 0);
    if (::fchmod(file.number(), to.status->st_mode & 07777U) != 0) fail("set permissions", errno, to.path);
  }

  void close() {
    if (file.close() != 0) fail("write the file", errno, to.path);
  }

  void replace() {
    takePermissions();
    if (::fsync(file.number()) != 0) fail("write the file", errno, to.path);
    if (name.empty() && !to.status && giveName(file.number(), to.file)) {
      close();
    } else {
      requireName();
      close();
      if (::rename(name.c_str(), to.file.c_str()) != 0) fail("replace the file", errno, to.path);
      name.clear();
    }
    synchronizeFolder(to);
  }
};

OutputFile::OutputFile(const fs::path& path) : state_(std::make_unique<State>(path)) {}
OutputFile::~OutputFile() = default;

bool OutputFile::takesOffsets() const {
  return !state_->to.through;
}

void OutputFile::write(std::uint64_t offset, std::span<const std::byte> bytes) {
  if (takesOffsets()) {
    writeTo(state_->file.number(), offset, bytes, state_->to.path);
  } else {
    const PipeSignalBlocked blocked;
    if (!writeAll(state_->file.number(), bytes)) fail("write the file", errno, state_->to.path);
  }
}

void OutputFile::reserve(std::uint64_t bytes) {
  if (!takesOffsets()) return;
  const int file = state_->file.number();
  const auto size = static_cast<off_t>(bytes);
  int result = 0;
  do {
    result = bytes > 0 ? ::fallocate(file, 0, 0, size) : 0;
  } while (result != 0 && errno == EINTR);
  // Not every file system can reserve space.
  if (result != 0 && errno == EOPNOTSUPP) result = ::ftruncate(file, size);
  if (result != 0) fail("write the file", errno, state_->to.path);
}

fs::path OutputFile::share() {
  assert(takesOffsets());
  state_->requireName();
  return fs::absolute(state_->name);
}

void OutputFile::commit() {
  if (takesOffsets()) {
    state_->replace();
  } else {
    state_->close();
  }
}

std::optional<SharedOutput> SharedOutput::open(const fs::path& shared, const fs::path& path) {
  const int descriptor = ::open(shared.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY);
  if (descriptor >= 0) return SharedOutput(path, descriptor);
  constexpr std::array notThere{ENOENT, ENOTDIR, EACCES, EPERM, EROFS, ESTALE};
  if (std::find(notThere.begin(), notThere.end(), errno) == notThere.end())
    fail("open the file", errno, path);
  return std::nullopt;
}

SharedOutput::SharedOutput(fs::path path, int descriptor) : path_(std::move(path)), descriptor_(descriptor) {}

SharedOutput::SharedOutput(SharedOutput&& other) noexcept
    : path_(std::move(other.path_)), descriptor_(std::exchange(other.descriptor_, -1)) {}

SharedOutput::~SharedOutput() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void SharedOutput::write(std::uint64_t offset, std::span<const std::byte> bytes) {
  writeTo(descriptor_, offset, bytes, path_);
}

void SharedOutput::finish() {
  if (::fsync(descriptor_) != 0 || ::close(std::exchange(descriptor_, -1)) != 0) {
    fail("write the file", errno, path_);
  }
}

void writeAtomically(const fs::path& path, std::span<const std::byte> bytes) {
  OutputFile file(path);
  file.write(0, bytes);
  file.commit();
}

void appendLine(const fs::path& path, std::string_view line) {
  std::FILE* const file = std::fopen(path.c_str(), "ae");
  bool isWritten = file != nullptr && std::fwrite(line.data(), 1, line.size(), file) == line.size() &&
                   std::fputc('\n', file) != EOF;
  if (file != nullptr && std::fclose(file) != 0) isWritten = false;
  if (!isWritten) fail("append a line", errno, path);
}

void replaceLink(const fs::path& link, const fs::path& target) {
  Status found{};
  if (::lstat(link.c_str(), &found) == 0 && !S_ISLNK(found.st_mode))
    throw Error(ErrorCode::Io, "can't replace it by a link: it exists and isn't a link", link.string());
  const fs::path made = temporaryName(link.has_parent_path() ? link.parent_path() : ".");
  if (::symlink(target.c_str(), made.c_str()) != 0) fail("make a link", errno, link);
  if (::rename(made.c_str(), link.c_str()) == 0) return;
  const int reason = errno;
  (void)::unlink(made.c_str());
  fail("make a link", reason, link);
}

fs::path requireWritable(const fs::path& path) {
  const Destination to(path);
  requireWritable(to);
  return to.through ? fs::path() : fs::canonical(to.folder()) / to.file.filename();
}

}  // namespace vdi::io
