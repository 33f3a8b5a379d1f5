// Memory of the host into which values of a GPU are copied.
#pragma once

#include <cstddef>
#include <memory>

#include "catalyst_adaptor/memory/Cuda.h"

namespace vdi::catalyst {

/// It stays in place. Until something is copied into it, it takes no memory, and reads as zeros.
class HostBuffer {
 public:
  /// Throws std::runtime_error if the process can't have so much.
  explicit HostBuffer(std::size_t bytes);
  ~HostBuffer();
  HostBuffer(const HostBuffer&) = delete;
  HostBuffer& operator=(const HostBuffer&) = delete;

  std::byte* data() const { return data_; }
  std::size_t bytes() const { return bytes_; }
  /// Page-locks it by the context of that device, once, so that the GPU copies at its full speed. It stays as
  /// it is where that fails.
  void lock(const std::shared_ptr<Cuda>& cuda, int device) noexcept;
  /// Leaves the memory to copies that may never end.
  void abandon() noexcept { data_ = nullptr; }

 private:
  std::byte* data_ = nullptr;
  std::size_t bytes_;
  std::shared_ptr<Cuda> lockedBy_;
  int device_ = 0;
  bool isTried_ = false;
};

}  // namespace vdi::catalyst
