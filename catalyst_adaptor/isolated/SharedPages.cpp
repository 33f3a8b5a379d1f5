#include "catalyst_adaptor/isolated/SharedPages.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string>
#include <utility>

namespace vdi::catalyst {

namespace {

/// A multiple of every host's page size, and of the granularity at which devices import memory.
constexpr std::uint64_t page = 65536;

[[noreturn]] void throwNoRoom(std::uint64_t bytes, int error) {
  throw std::runtime_error("not enough memory for " + std::to_string((bytes >> 20) + 1) +
                           " MiB to share with the process that makes frames: " + std::strerror(error));
}

/// Throws if the size is beyond this process's limit, where the kernel would send a signal that ends the
/// process.
void requireWithinLimit(std::uint64_t bytes) {
  rlimit limit{};
  if (getrlimit(RLIMIT_FSIZE, &limit) == 0 && limit.rlim_cur < bytes) throwNoRoom(bytes, EFBIG);
}

std::span<std::byte> map(int descriptor, std::uint64_t size) {
  void* pages = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
  if (pages == MAP_FAILED) throwNoRoom(size, errno);
  return {static_cast<std::byte*>(pages), size};
}

}  // namespace

SharedPages::SharedPages(std::uint64_t bytes) {
  const std::uint64_t size = (std::max<std::uint64_t>(bytes, 1) + page - 1) / page * page;
  requireWithinLimit(size);
  descriptor_ = Descriptor(memfd_create("pv-vdi", MFD_CLOEXEC));
  if (!descriptor_.isOpen()) throwNoRoom(size, errno);
  int error = EINTR;  // a signal may interrupt it
  while (error == EINTR) error = posix_fallocate(descriptor_.number(), 0, static_cast<off_t>(size));
  if (error != 0) throwNoRoom(size, error);
  bytes_ = map(descriptor_.number(), size);
}

SharedPages::SharedPages(Descriptor descriptor) : descriptor_(std::move(descriptor)) {
  struct stat status {};
  if (fstat(descriptor_.number(), &status) != 0 || status.st_size <= 0)
    throw std::runtime_error("memory shared with the simulation can't be opened");
  bytes_ = map(descriptor_.number(), static_cast<std::uint64_t>(status.st_size));
}

SharedPages::SharedPages(SharedPages&& other) noexcept
    : descriptor_(std::move(other.descriptor_)), bytes_(std::exchange(other.bytes_, {})) {}

SharedPages& SharedPages::operator=(SharedPages&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  std::swap(bytes_, other.bytes_);
  return *this;
}

SharedPages::~SharedPages() {
  if (!bytes_.empty()) munmap(bytes_.data(), bytes_.size());
}

}  // namespace vdi::catalyst
