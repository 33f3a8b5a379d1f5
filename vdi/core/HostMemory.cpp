#include "vdi/core/HostMemory.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <random>
#include <string_view>
#include <system_error>

#include "vdi/core/Descriptor.h"
#include "vdi/core/Error.h"

namespace vdi {

namespace {

/// A multiple of Linux's usual page sizes, at which devices can import memory.
constexpr std::uint64_t page = 65536;

std::uint64_t wholePages(std::uint64_t bytes) {
  return (std::max<std::uint64_t>(bytes, 1) + page - 1) / page * page;
}

[[noreturn]] void throwNoRoom(std::uint64_t bytes, const char* kind, int error) {
  throw Error(ErrorCode::OutOfMemory,
              fmt::format("not enough {} memory for {} MiB: {}", kind, bytes >> 20, std::strerror(error)));
}

std::span<std::byte> map(std::uint64_t size, int flags, int descriptor, const char* kind) {
  void* pages = mmap(nullptr, size, PROT_READ | PROT_WRITE, flags, descriptor, 0);
  if (pages == MAP_FAILED) throwNoRoom(size, kind, errno);
  return {static_cast<std::byte*>(pages), size};
}

/// The folder of shm_open's names.
const std::string folder = "/dev/shm";
constexpr std::string_view prefix = "/pv-vdi-";

/// Unlinks the memory that killed processes have left. A live process holds a lock on its memory.
void removeNamesOfTheDead() {
  std::error_code unreadable;
  using Iterator = std::filesystem::directory_iterator;
  for (Iterator entry(folder, unreadable); !unreadable && entry != Iterator(); entry.increment(unreadable)) {
    const std::string name = fmt::format("/{}", entry->path().filename().string());
    if (!name.starts_with(prefix)) continue;
    const Descriptor file(shm_open(name.c_str(), O_RDWR, 0));  // fails for another user's memory
    if (file.isOpen() && flock(file.number(), LOCK_EX | LOCK_NB) == 0) shm_unlink(name.c_str());
  }
}

/// A name that no other process of the host uses, in any container.
std::string newName() {
  static std::atomic<std::uint32_t> made{0};
  static const std::uint64_t process = (std::uint64_t{std::random_device()()} << 32) | std::random_device()();
  // A forked process inherits all of these except getpid().
  return fmt::format("{}{:x}-{}-{}", prefix, process, getpid(), made++);
}

}  // namespace

std::shared_ptr<HostMemory> HostMemory::anonymous(std::uint64_t bytes) {
  std::shared_ptr<HostMemory> memory(new HostMemory);
  const std::uint64_t size = wholePages(bytes);
  memory->bytes_ = map(size, MAP_PRIVATE | MAP_ANONYMOUS, -1, "host");
  madvise(memory->bytes_.data(), size, MADV_HUGEPAGE);  // fewer pages to pin; only a hint
  return memory;
}

std::shared_ptr<HostMemory> HostMemory::shareable(std::uint64_t bytes) {
  std::shared_ptr<HostMemory> memory(new HostMemory);
  const std::uint64_t size = wholePages(bytes);
  memory->descriptor_ = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (memory->descriptor_ < 0) throwNoRoom(size, "shared", errno);
  int error = EINTR;  // a signal may interrupt it
  while (error == EINTR) error = posix_fallocate(memory->descriptor_, 0, static_cast<off_t>(size));
  if (error != 0) throwNoRoom(size, "shared", error);
  memory->bytes_ = map(size, MAP_SHARED, memory->descriptor_, "shared");
  memory->name_ = newName();
  return memory;
}

std::shared_ptr<HostMemory> HostMemory::shared(std::uint64_t bytes) {
  std::shared_ptr<HostMemory> memory = shareable(bytes);
  if (!memory->publish()) throwNoRoom(memory->bytes_.size(), "shared", errno);
  return memory;
}

bool HostMemory::publish() {
  if (linked_) return true;
  if (descriptor_ < 0) return false;
  static std::atomic<pid_t> remover{0};  // a process id, so that a forked process removes names, too
  if (remover.exchange(getpid()) != getpid()) removeNamesOfTheDead();
  // Lock the memory before naming it: another process that finds it unlocked takes this one to have ended.
  if (flock(descriptor_, LOCK_EX | LOCK_NB) != 0) return false;
  const std::string self = fmt::format("/proc/self/fd/{}", descriptor_);
  linked_ = linkat(AT_FDCWD, self.c_str(), AT_FDCWD, (folder + name_).c_str(), AT_SYMLINK_FOLLOW) == 0;
  return linked_;
}

std::shared_ptr<HostMemory> HostMemory::open(const std::string& name, std::uint64_t bytes) {
  std::shared_ptr<HostMemory> memory(new HostMemory);
  const std::uint64_t size = wholePages(bytes);
  const Descriptor file(shm_open(name.c_str(), O_RDWR, 0));
  struct stat status {};
  if (!file.isOpen() || fstat(file.number(), &status) != 0 ||
      static_cast<std::uint64_t>(status.st_size) < size) {
    throw Error(ErrorCode::Communication,
                fmt::format("the shared memory {} of another rank can't be opened", name));
  }
  memory->bytes_ = map(size, MAP_SHARED, file.number(), "shared");
  memory->name_ = name;
  return memory;
}

HostMemory::~HostMemory() {
  unlink();
  if (!bytes_.empty()) munmap(bytes_.data(), bytes_.size());
}

void HostMemory::unlink() {
  if (linked_) shm_unlink(name_.c_str());
  linked_ = false;
  if (descriptor_ >= 0) close(descriptor_);
  descriptor_ = -1;
}

}  // namespace vdi
