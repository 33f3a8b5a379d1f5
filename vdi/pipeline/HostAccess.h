// A device's access to pages of the host, and vectors made of such pages. Not part of the library's
// interface.
#pragma once

#include <cstdint>
#include <memory>
#include <memory_resource>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "vdi/core/HostMemory.h"
#include "vdi/core/HostVector.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/Memory.h"

namespace vdi::detail {

/// Host memory that a device copies to and from. Where the driver imports it (VK_EXT_external_memory_host),
/// the host copies nothing; elsewhere the data passes through staging memory.
class HostAccess {
 public:
  HostAccess(std::shared_ptr<gpu::Device> device, std::shared_ptr<HostMemory> memory);

  const std::shared_ptr<HostMemory>& memory() const { return memory_; }

  /// Copies from the device to byte offset `at` of the memory. The copy is complete once the commands have
  /// run and `finish` has been called.
  void recordWrite(gpu::Commands& commands, const gpu::Buffer& from, std::uint64_t fromOffset,
                   std::uint64_t at, std::uint64_t bytes);
  /// Copies from byte offset `at` of the memory to the device. The memory must hold the data when this is
  /// called.
  void recordRead(gpu::Commands& commands, std::uint64_t at, const gpu::Buffer& to, std::uint64_t toOffset,
                  std::uint64_t bytes);
  /// Call after the commands complete; copies staged data to the host.
  void finish();
  /// Call instead of `finish` to discard the data after an error. All commands that it recorded must be done.
  void drop() { staged_.clear(); }

 private:
  struct Staged {
    gpu::Buffer buffer;
    std::uint64_t at = 0;
    std::uint64_t bytes = 0;  // 0: belongs to a read, which needs no copy afterwards
  };
  std::shared_ptr<gpu::Device> device_;
  std::shared_ptr<HostMemory> memory_;
  std::optional<gpu::ImportedBuffer> imported_;
  std::vector<Staged> staged_;
};

/// Memory for HostVectors that a device fills. Freed blocks are reused, because making pages accessible to a
/// device takes longer than filling them. The pool may outlive the device if vectors do. Thread-safe.
class HostPool final : public std::pmr::memory_resource {
 public:
  enum class Visible {
    ToProcess,
    ToHost  // also to other ranks of the host, where shared memory suffices
  };
  HostPool(std::shared_ptr<gpu::Device> device, Visible visible);
  ~HostPool() override;
  HostPool(const HostPool&) = delete;
  HostPool& operator=(const HostPool&) = delete;
  HostPool(HostPool&&) = delete;
  HostPool& operator=(HostPool&&) = delete;

  /// The memory, and the position in it, of a vector's data; null if it does not come from this pool.
  struct Place {
    HostAccess* access = nullptr;
    std::uint64_t at = 0;
  };
  Place placeOf(const void* data);
  /// Names under which other processes can open the memory that vectors have or may get. Memory without a
  /// name is left out.
  std::vector<std::string> names();

  /// Releases the device. Vectors in use stay valid.
  void detach() noexcept;

 private:
  struct Block {
    std::shared_ptr<HostMemory> memory;
    std::unique_ptr<HostAccess> access;
    bool used = false;
    std::uint64_t freed = 0;  // time of the last free, counted in frees
  };
  void* do_allocate(std::size_t bytes, std::size_t alignment) override;
  void do_deallocate(void* data, std::size_t bytes, std::size_t alignment) override;
  bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override { return this == &other; }
  std::shared_ptr<HostMemory> newMemory(std::uint64_t bytes) const;

  std::mutex mutex_;
  std::shared_ptr<gpu::Device> device_;
  Visible visible_;
  std::vector<Block> blocks_;
  std::uint64_t frees_ = 0;
};

}  // namespace vdi::detail
