// The opened device as Vulkan's functions see it: what vdi/gpu is made from. gpu::Device is what others see.
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

namespace vdi::gpu {

struct DeviceCandidate;
class Instance;

/// What a queue is for. Where the hardware has copy engines, Transfer is theirs: what's submitted there goes
/// on beside what computes. Elsewhere both are the same queue.
enum class QueueKind { Compute, Transfer };

class VulkanDevice {
 public:
  /// With every feature that the candidate's limits and Device::create promise. The instance must live
  /// longer. Throws Error{DeviceUnavailable} if the device can't be opened.
  VulkanDevice(const Instance& instance, const DeviceCandidate& chosen);
  ~VulkanDevice();  // waits until the device is idle
  VulkanDevice(const VulkanDevice&) = delete;
  VulkanDevice& operator=(const VulkanDevice&) = delete;
  VulkanDevice(VulkanDevice&&) = delete;
  VulkanDevice& operator=(VulkanDevice&&) = delete;

  VkDevice handle() const { return device_; }
  std::uint32_t queueFamily(QueueKind kind) const { return queue(kind).family; }
  /// Compiled once for all who ask for it, if it's a shader of the library. From any thread.
  std::shared_ptr<const CompiledPipeline> compiled(const ComputePipelineInfo& info,
                                                   std::uint32_t subgroupSize);

  /// Index of the first memory type that `typeBits` allows and that has `wanted`, if there's one; by Vulkan's
  /// order that's the one with the fewest other properties.
  std::optional<std::uint32_t> findMemoryType(std::uint32_t typeBits, VkMemoryPropertyFlags wanted) const;
  /// The same; throws Error{OutOfMemory} if there's none.
  std::uint32_t memoryType(std::uint32_t typeBits, VkMemoryPropertyFlags wanted) const;
  /// Memory types as which memory of the process at `pages`, aligned to hostPointerAlignment, can be
  /// imported; 0: none.
  std::uint32_t memoryTypesOfHostPointer(const void* pages) const;

  /// Submits to a queue; the result is how many submissions that queue has had, this one included, which is
  /// what its timeline semaphore reaches when this one is done. From any thread.
  std::uint64_t submit(QueueKind kind, std::span<const VkSemaphoreSubmitInfo> waits,
                       VkCommandBuffer commands);
  /// Waits for that many. Throws Error{DeviceFailure} on device loss.
  void wait(QueueKind kind, std::uint64_t submissions) const;
  /// Whether a submission or a wait has found it lost: it stays so.
  bool isLost() const { return lost_; }
  /// For `waits` of submit.
  VkSemaphore submissionsDone(QueueKind kind) const { return queue(kind).done; }

  /// What validation messages and debuggers call an object. Does nothing unless the instance validates.
  template <typename Handle>
  void setName(VkObjectType type, Handle handle, const std::string& name) const {
    if (names_.set != nullptr) setNameOf(type, reinterpret_cast<std::uint64_t>(handle), name);
  }
  /// What they call the commands from here on, until endLabel. Likewise.
  void beginLabel(VkCommandBuffer commands, const std::string& name) const;
  void endLabel(VkCommandBuffer commands) const;

 private:
  struct Queue {
    VkQueue handle = VK_NULL_HANDLE;
    std::uint32_t family = 0;
    // Timeline: counts submissions that are done. It lives as long as the device because drivers may touch it
    // a moment longer than the submission takes: Mesa 22.3's queue thread does.
    VkSemaphore done = VK_NULL_HANDLE;
    std::uint64_t submissions = 0;
  };
  const Queue& queue(QueueKind kind) const { return queues_[static_cast<std::size_t>(kind)]; }
  Queue& queue(QueueKind kind) { return queues_[static_cast<std::size_t>(kind)]; }
  void setUp();
  void release() noexcept;
  void setNameOf(VkObjectType type, std::uint64_t handle, const std::string& name) const;
  void checkForLoss(VkResult result, const char* call) const;

  std::string name_;
  VkDevice device_ = VK_NULL_HANDLE;
  std::array<Queue, 2> queues_;  // by kind
  std::mutex queueMutex_;
  mutable std::atomic<bool> lost_ = false;
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
