// CUDA as the simulation uses it: functions of the libcuda that the process has loaded. Nothing here links
// CUDA or loads it, and no header of it is needed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>
#include <string>

#include "catalyst_adaptor/memory/RowCopy.h"

namespace vdi::catalyst {

/// The copies may still be made, so the host's memory must stay.
struct StillCopying : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The functions throw std::runtime_error with CUDA's reason. They leave the thread's current context as it
/// was. One thread calls them at a time.
class Cuda {
 public:
  /// Null unless the process has loaded libcuda.so.1 with all functions that are needed here.
  static std::shared_ptr<Cuda> find();
  ~Cuda();
  Cuda(const Cuda&) = delete;
  Cuda& operator=(const Cuda&) = delete;

  /// The memory of a device in which an address lies.
  struct Memory {
    void* context = nullptr;  // null: that of no single context, such as memory of a pool
    int device = 0;
    std::uintptr_t begin = 0;  // of the allocation, or of the reserved addresses
    std::uintptr_t end = 0;
  };
  /// nullopt if the host may read the address, as far as CUDA knows: of the host's memory, page-locked or
  /// not, and of memory that CUDA doesn't know or no longer knows. Managed memory counts as a device's.
  std::optional<Memory> memoryAt(const void* address) const;
  /// Whether addresses from the range's begin on are mapped; returns the first one that isn't. For memory
  /// without a context, which may be mapped in parts.
  std::optional<std::uintptr_t> firstUnmapped(const Memory& memory, const MemoryRange& range);
  /// The context in which to use the memory.
  void* contextOf(const Memory& memory);

  /// Waits until the work that was queued on a stream before is done. Streams that belong to no context (null
  /// and the other two default streams) are those of each of `contexts`. Throws after `seconds`.
  void await(void* stream, const std::set<void*>& contexts, double seconds);
  /// Copies memory of one context, not after any stream's work, and returns when all is done. Throws
  /// StillCopying after `seconds`.
  void copy(void* context, std::span<const RowCopy> copies, double seconds);
  /// Page-locks memory of the host for all devices, if the device's primary context is in use. Returns
  /// whether it is page-locked; `unlock` undoes it.
  bool lock(int device, std::byte* memory, std::size_t bytes) noexcept;
  void unlock(int device, std::byte* memory) noexcept;

 private:
  struct Functions;
  class Current;  // makes a context the thread's current one
  class Handle;

  explicit Cuda(void* library, std::unique_ptr<Functions> functions);
  void* primaryContext(int device);
  [[noreturn]] void fail(const char* call, int result) const;
  void require(const char* call, int result) const;
  bool awaitCurrent(void* stream, double seconds) const;
  void enqueue(const RowCopy& rows, void* stream) const;

  void* library_;
  std::unique_ptr<Functions> functions_;
  std::map<int, void*> primaries_;  // the devices' primary contexts, retained
};

}  // namespace vdi::catalyst
