// The opened device with its Vulkan handles, for the rest of vdi/gpu. Others use gpu::Device.
#pragma once

#include <vulkan/vulkan.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>

#include "vdi/gpu/CompiledPipeline.h"
#include "vdi/gpu/PipelineCacheFile.h"

namespace vdi::gpu {

struct DeviceCandidate;
class Instance;

/// A queue's purpose. On hardware with copy engines, Transfer is their queue: its submissions overlap with
/// computation. Elsewhere both are the same queue.
enum class QueueKind { Compute, Transfer };

class VulkanDevice {
 public:
  /// Opens the device with every feature that the candidate's limits and Device::create promise. The instance
  /// must outlive it. Compiled shaders come from the cache's folder, and go there at the end. Throws
  /// Error{DeviceUnavailable} if the device cannot be opened.
  VulkanDevice(const Instance& instance, const DeviceCandidate& chosen, const std::string& cacheFolder);
  ~VulkanDevice();  // waits until the device is idle
  VulkanDevice(const VulkanDevice&) = delete;
  VulkanDevice& operator=(const VulkanDevice&) = delete;
  VulkanDevice(VulkanDevice&&) = delete;
  VulkanDevice& operator=(VulkanDevice&&) = delete;

  VkDevice handle() const { return device_; }
  std::uint32_t queueFamily(QueueKind kind) const { return queue(kind).family; }
  /// Returns the pipeline, which all its users share if the shader is the library's. Thread-safe.
  std::shared_ptr<const CompiledPipeline> compiled(const ComputePipelineInfo& info,
                                                   std::uint32_t subgroupSize);

  /// Index of the first memory type that `typeBits` allows and that has `wanted`; nullopt if there is none.
  /// By Vulkan's order it is the one with the fewest other properties.
  std::optional<std::uint32_t> findMemoryType(std::uint32_t typeBits, VkMemoryPropertyFlags wanted) const;
  /// Like findMemoryType, but throws Error{OutOfMemory} if there is none.
  std::uint32_t memoryType(std::uint32_t typeBits, VkMemoryPropertyFlags wanted) const;
  /// Bits of the memory types under which the process's memory at `pages`, aligned to hostPointerAlignment,
  /// can be imported; 0: none.
  std::uint32_t memoryTypesOfHostPointer(const void* pages) const;

  /// Counts device memory that was allocated (bytes > 0) or freed (bytes < 0). Thread-safe.
  void accountAllocation(std::int64_t bytes) { allocated_ += bytes; }
  std::uint64_t allocatedBytes() const { return static_cast<std::uint64_t>(allocated_.load()); }

  /// Submits to a queue and returns its number of submissions, including this one. Its timeline semaphore
  /// reaches that number when this submission is complete. Thread-safe.
  std::uint64_t submit(QueueKind kind, std::span<const VkSemaphoreSubmitInfo> waits,
                       VkCommandBuffer commands);
  /// Waits until that many submissions are complete. Throws Error{DeviceFailure} on device loss.
  void wait(QueueKind kind, std::uint64_t submissions) const;
  /// Whether a submission or a wait has found the device lost; it stays so.
  bool isLost() const { return lost_; }
  /// The queue's semaphore, for `waits` of submit.
  VkSemaphore submissionsDone(QueueKind kind) const { return queue(kind).done; }

  /// Names an object in validation messages and debuggers. Does nothing unless the instance validates.
  template <typename Handle>
  void setName(VkObjectType type, Handle handle, const std::string& name) const {
    if (names_.set != nullptr) setNameOf(type, reinterpret_cast<std::uint64_t>(handle), name);
  }
  /// Labels the commands from here on, until endLabel. Does nothing unless the instance validates.
  void beginLabel(VkCommandBuffer commands, const std::string& name) const;
  void endLabel(VkCommandBuffer commands) const;

 private:
  struct Queue {
    VkQueue handle = VK_NULL_HANDLE;
    std::uint32_t family = 0;
    // Timeline semaphore that counts completed submissions. It lives as long as the device because drivers
    // may use it a moment longer than the submission takes: Mesa 22.3's queue thread does.
    VkSemaphore done = VK_NULL_HANDLE;
    std::uint64_t submissions = 0;
  };
  const Queue& queue(QueueKind kind) const { return queues_[static_cast<std::size_t>(kind)]; }
  Queue& queue(QueueKind kind) { return queues_[static_cast<std::size_t>(kind)]; }
  void setUp();
  void saveCache() const noexcept;
  void release() noexcept;
  void setNameOf(VkObjectType type, std::uint64_t handle, const std::string& name) const;
  void checkForLoss(VkResult result, const char* call) const;

  std::string name_;
  VkDevice device_ = VK_NULL_HANDLE;
  std::array<Queue, 2> queues_;  // by kind
  std::mutex queueMutex_;
  mutable std::atomic<bool> lost_ = false;
  std::atomic<std::int64_t> allocated_ = 0;
  PipelineCacheFile cacheFile_;
  std::size_t cachedBytes_ = 0;  // size of the file's data
  VkPipelineCache cache_ = VK_NULL_HANDLE;
  CompiledPipelines compiled_;
  VkPhysicalDeviceMemoryProperties memory_{};
  PFN_vkGetMemoryHostPointerPropertiesEXT hostPointerProperties_ = nullptr;
  struct {
    PFN_vkSetDebugUtilsObjectNameEXT set = nullptr;
    PFN_vkCmdBeginDebugUtilsLabelEXT begin = nullptr;
    PFN_vkCmdEndDebugUtilsLabelEXT end = nullptr;
  } names_;
};

}  // namespace vdi::gpu
