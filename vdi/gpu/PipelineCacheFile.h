// Compiled shaders on disk, for the next run.
#pragma once

#include <vulkan/vulkan.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace vdi::gpu {

/// The driver and device that a file's data are for. Each version of a driver has a file of its own.
struct PipelineCacheKey {
  std::uint32_t vendor = 0;
  std::uint32_t device = 0;
  std::uint32_t driverVersion = 0;
  std::array<std::uint8_t, VK_UUID_SIZE> cacheUuid{};
  std::array<std::uint8_t, VK_UUID_SIZE> driverUuid{};
};
PipelineCacheKey pipelineCacheKeyOf(VkPhysicalDevice device);

/// A file in `folder`. No function throws: a cache that can't be read or written only costs time. Several
/// processes may read and write at once: a reader finds one writer's whole data, or none.
class PipelineCacheFile {
 public:
  /// If `folder` is empty, there is no file.
  PipelineCacheFile(std::string folder, const PipelineCacheKey& key);

  /// Data for VkPipelineCacheCreateInfo. Empty unless the file is this user's own, whole, and the key's.
  std::vector<std::byte> read() const noexcept;
  /// Replaces the file, and creates the folder if necessary. Does nothing if `data` are Vulkan's header
  /// alone, which is all that a driver gives if it keeps compiled shaders itself, or keeps none.
  void write(std::span<const std::byte> data) const noexcept;

 private:
  std::string folder_;
  std::string path_;
  PipelineCacheKey key_;
};

}  // namespace vdi::gpu
