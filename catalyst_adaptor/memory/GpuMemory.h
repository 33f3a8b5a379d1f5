// The memory of GPUs, as far as a simulation's pointers lead there.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "catalyst_adaptor/memory/Cuda.h"
#include "catalyst_adaptor/memory/HostBuffer.h"
#include "catalyst_adaptor/memory/OtherGpus.h"

namespace vdi::catalyst {

/// Rows to copy into a buffer, and what they are a part of, for messages.
struct BufferCopy {
  RowCopy rows;
  std::shared_ptr<HostBuffer> to;
  std::string_view owner;
  std::optional<std::size_t> block{};  // of the owner

  std::string name() const {
    return (block ? "block " + std::to_string(*block) + " of " : "") + std::string(owner);
  }
};

/// A run's view of them. Its functions ask only libraries that the process has loaded.
class GpuMemory {
 public:
  /// Whether the range lies in a CUDA device's memory, from which values are copied. Other memory is the
  /// host's, as far as anybody knows. Throws std::invalid_argument, with a text to follow the range's name,
  /// if a part of the range lies outside its allocation or isn't mapped, or if it is another GPU's.
  bool isOfCuda(const MemoryRange& range);

  /// The stream whose work has to be done before values are read, a CUstream; null: the default stream of the
  /// contexts that have the values. Throws std::invalid_argument if the process hasn't loaded CUDA.
  void setStream(void* stream);
  bool hasStream() const { return hasStream_; }
  /// Waits for the stream, and then copies. When it returns, the values may change. Throws std::runtime_error
  /// if memory isn't what it was, a copy fails, or the stream takes longer than VDI_CUDA_PATIENCE.
  void copy(std::span<const BufferCopy> copies);
  /// Reads bytes that may lie in CUDA's memory: waits and copies as `copy` does. `to` has room for them.
  /// Throws std::invalid_argument, with a text to follow the range's name, if they can't be read.
  void read(const MemoryRange& range, std::byte* to);

 private:
  void look();

  std::shared_ptr<Cuda> cuda_;  // null while the process hasn't loaded it
  OtherGpus others_;
  std::uint64_t loads_ = 0;  // the number of libraries that the process had loaded at the last look
  void* stream_ = nullptr;
  bool hasStream_ = false;  // whether the simulation has set it
};

}  // namespace vdi::catalyst
