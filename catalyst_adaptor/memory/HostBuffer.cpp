#include "catalyst_adaptor/memory/HostBuffer.h"

#include <sys/mman.h>

#include <stdexcept>
#include <string>
#include <utility>

namespace vdi::catalyst {

HostBuffer::HostBuffer(std::size_t bytes) : bytes_(bytes) {
  void* const memory =
      mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (memory == MAP_FAILED)
    throw std::runtime_error("no memory for the copy of values of a GPU: " + std::to_string(bytes) +
                             " bytes");
  data_ = static_cast<std::byte*>(memory);
}

HostBuffer::~HostBuffer() {
  if (data_ == nullptr) return;
  if (lockedBy_) lockedBy_->unlock(device_, data_);
  munmap(data_, bytes_);
}

void HostBuffer::lock(const std::shared_ptr<Cuda>& cuda, int device) noexcept {
  if (std::exchange(isTried_, true) || !cuda->lock(device, data_, bytes_)) return;
  lockedBy_ = cuda;
  device_ = device;
}

}  // namespace vdi::catalyst
