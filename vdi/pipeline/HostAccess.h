// A device's way to pages of the host, and vectors made of such pages. Not part of the library's interface.
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

/// Host memory that a device copies to and from: without a copy by the host where the driver imports it
/// (VK_EXT_external_memory_host), else by way of staging memory.
class HostAccess {
 public:
  HostAccess(std::shared_ptr<gpu::Device> device, std::shared_ptr<HostMemory> memory);

  const std::shared_ptr<HostMemory>& memory() const { return memory_; }

  /// From the device to `at` bytes into the memory. It's there once the commands are done and after `finish`.
  void recordWrite(gpu::Commands& commands, const gpu::Buffer& from, std::uint64_t fromOffset,
                   std::uint64_t at, std::uint64_t bytes);
  /// From `at` bytes into the memory, which must be there already, to the device.
  void recordRead(gpu::Commands& commands, std::uint64_t at, const gpu::Buffer& to, std::uint64_t toOffset,
                  std::uint64_t bytes);
  /// To be called when the commands are done.
  void finish();
  /// Or this, if what they brought isn't wanted: after an error. Whatever else it has recorded must be done.
  void drop() { staged_.clear(); }

 private:
  struct Staged {
    gpu::Buffer buffer;
    std::uint64_t at = 0;
    std::uint64_t bytes = 0;  // 0: of a read, nothing is left to do
  };
  std::shared_ptr<gpu::Device> device_;
  std::shared_ptr<HostMemory> memory_;
  std::optional<gpu::ImportedBuffer> imported_;
  std::vector<Staged> staged_;
};

/// Where HostVectors that a device fills get their memory from. Blocks that nobody uses any more are used
/// again: to make pages known to a device takes longer than to fill them. Outlives the device if vectors do.
/// From any thread.
class HostPool final : public std::pmr::memory_resource {
 public:
  enum class Visible {
    ToProcess,
    ToHost  // to other ranks of the host too, as far as there's shared memory
  };
  HostPool(std::shared_ptr<gpu::Device> device, Visible visible);
  ~HostPool() override;
  HostPool(const HostPool&) = delete;
  HostPool& operator=(const HostPool&) = delete;
  HostPool(HostPool&&) = delete;
  HostPool& operator=(HostPool&&) = delete;

  /// Where in which memory a vector's data lies that has its memory from here; null: it has not.
  struct Place {
    HostAccess* access = nullptr;
    std::uint64_t at = 0;
  };
  Place placeOf(const void* data);
  /// Of all memory that vectors have or may get, as other processes open it; not of what they can't.
  std::vector<std::string> names();

  /// Lets go of the device. Vectors that are in use stay as they are.
  void detach() noexcept;

 private:
  struct Block {
    std::shared_ptr<HostMemory> memory;
    std::unique_ptr<HostAccess> access;
    bool used = false;
    std::uint64_t freed = 0;  // when, counted in frees
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
