#include "vdi/core/HostMemory.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <random>

#include "vdi/core/Error.h"

namespace vdi {

namespace {

/// Of a size that every Linux maps, and that devices import.
constexpr std::uint64_t page = 65536;

std::uint64_t wholePages(std::uint64_t bytes) {
  return (std::max<std::uint64_t>(bytes, 1) + page - 1) / page * page;
}

class File {
 public:
  explicit File(int descriptor) : descriptor_(descriptor) {}
  ~File() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  int descriptor() const { return descriptor_; }

 private:
  int descriptor_;
};

[[noreturn]] void throwNoRoom(std::uint64_t bytes, const char* kind, int error) {
  throw Error(ErrorCode::OutOfMemory,
              fmt::format("no room for {} MiB of {} memory: {}", bytes >> 20, kind, std::strerror(error)));
}

std::span<std::byte> map(std::uint64_t size, int flags, int descriptor, const char* kind) {
  void* pages = mmap(nullptr, size, PROT_READ | PROT_WRITE, flags, descriptor, 0);
  if (pages == MAP_FAILED) throwNoRoom(size, kind, errno);
  return {static_cast<std::byte*>(pages), size};
}

/// That no other process of the host uses, whatever container it's in.
std::string newName() {
  static std::atomic<std::uint32_t> made{0};
  static const std::uint64_t process = (std::uint64_t{std::random_device()()} << 32) | std::random_device()();
  return fmt::format("/pv-vdi-{:x}-{}", process, made++);
}

}  // namespace

std::shared_ptr<HostMemory> HostMemory::anonymous(std::uint64_t bytes) {
  std::shared_ptr<HostMemory> memory(new HostMemory);
  const std::uint64_t size = wholePages(bytes);
  memory->bytes_ = map(size, MAP_PRIVATE | MAP_ANONYMOUS, -1, "host");
  madvise(memory->bytes_.data(), size, MADV_HUGEPAGE);  // fewer to pin; a wish
  return memory;
}

std::shared_ptr<HostMemory> HostMemory::shared(std::uint64_t bytes) {
  std::shared_ptr<HostMemory> memory(new HostMemory);
  const std::uint64_t size = wholePages(bytes);
  const std::string name = newName();
  const File file(shm_open(name.c_str(), O_CREAT | O_EXCL | O_RDWR, S_IRUSR | S_IWUSR));
  if (file.descriptor() < 0) throwNoRoom(size, "shared", errno);
  memory->name_ = name;
  memory->linked_ = true;
  int error = EINTR;  // a signal may come between
  while (error == EINTR) error = posix_fallocate(file.descriptor(), 0, static_cast<off_t>(size));
  if (error != 0) throwNoRoom(size, "shared", error);
  memory->bytes_ = map(size, MAP_SHARED, file.descriptor(), "shared");
  return memory;
}

std::shared_ptr<HostMemory> HostMemory::open(const std::string& name, std::uint64_t bytes) {
  std::shared_ptr<HostMemory> memory(new HostMemory);
  const std::uint64_t size = wholePages(bytes);
  const File file(shm_open(name.c_str(), O_RDWR, 0));
  struct stat status {};
  if (file.descriptor() < 0 || fstat(file.descriptor(), &status) != 0 ||
      static_cast<std::uint64_t>(status.st_size) < size) {
    throw Error(ErrorCode::Communication,
                fmt::format("the shared memory {} of another rank can't be opened", name));
  }
  memory->bytes_ = map(size, MAP_SHARED, file.descriptor(), "shared");
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
}

}  // namespace vdi
