// Memory that two processes of a host share by its descriptor.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "vdi/core/Descriptor.h"

namespace vdi::catalyst {

/// Memory without a name, which is gone when both processes are. It doesn't lie in /dev/shm, so a
/// small or full /dev/shm doesn't matter.
class SharedPages {
 public:
  SharedPages() = default;
  /// Allocates all pages at once, so that a later write can't fail. Throws std::runtime_error if there is no
  /// room.
  explicit SharedPages(std::uint64_t bytes);
  /// Maps pages that the other process has made. Throws std::runtime_error.
  explicit SharedPages(Descriptor descriptor);
  SharedPages(SharedPages&& other) noexcept;
  SharedPages& operator=(SharedPages&& other) noexcept;
  ~SharedPages();

  std::span<std::byte> bytes() const { return bytes_; }
  int descriptor() const { return descriptor_.number(); }

 private:
  Descriptor descriptor_;
  std::span<std::byte> bytes_;
};

}  // namespace vdi::catalyst
