// One Vulkan device with one compute queue. Everything else in vdi/gpu is made from it and keeps it alive.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace vdi::gpu {

struct DeviceRequest {
  /// Index (as `vdi info --devices` lists them) or part of the name, case-insensitive. Empty: the best
  /// device; equal ones are dealt out by localRank.
  std::string selector;
  int localRank = 0;        // rank among the ranks of this node
  bool validation = false;  // VK_LAYER_KHRONOS_validation; every message of severity warning or error is kept
};

/// The request that the environment asks for: VDI_DEVICE is the selector, VDI_VALIDATION=1 turns validation
/// on.
DeviceRequest requestFromEnvironment(int localRank);

struct DeviceLimits {
  std::uint64_t memoryBytes = 0;         // of the largest device-local heap
  std::uint64_t maxAllocationBytes = 0;  // VkPhysicalDeviceMaintenance3Properties / 4
  std::uint32_t maxImageDimension3D = 0;
  float timestampPeriodNs = 0.0F;
};

class Device {
 public:
  /// Throws Error{DeviceUnavailable}; the text lists every device of the machine and why it was refused, or
  /// that there's no Vulkan driver at all. What's demanded: Vulkan 1.3, a compute queue with timestamps,
  /// hostQueryReset, bufferDeviceAddress, scalarBlockLayout, shaderInt64, timelineSemaphore,
  /// synchronization2, maintenance4, linear filtering of 3-D R32_SFLOAT, R16_UNORM and R8_UNORM images.
  /// Preference: discrete, integrated, virtual, CPU.
  static std::shared_ptr<Device> create(const DeviceRequest& request);
  /// A line per device: index, name, type, driver, memory, "usable" or why not. Never throws.
  static std::string describeAll();

  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  Device(Device&&) = delete;
  Device& operator=(Device&&) = delete;

  const std::string& name() const;  // as the driver gives it
  bool isCpu() const;               // VK_PHYSICAL_DEVICE_TYPE_CPU, lavapipe for example
  const DeviceLimits& limits() const;

  VkInstance instance() const;
  VkPhysicalDevice physicalDevice() const;
  VkDevice handle() const;
  VkQueue queue() const;
  std::uint32_t queueFamily() const;
  VkPipelineCache pipelineCache() const;

  /// Index of a memory type that `typeBits` allows and that has `wanted`; throws Error{OutOfMemory} if
  /// there's none.
  std::uint32_t memoryType(std::uint32_t typeBits, VkMemoryPropertyFlags wanted) const;
  /// Bytes of device memory that Buffers and Images of this device hold now.
  std::uint64_t allocatedBytes() const;
  void accountAllocation(std::int64_t bytes);

  /// Number of validation messages so far, and the text of the latest ones. 0 and empty without validation.
  std::uint32_t validationMessageCount() const;
  std::string validationMessages() const;

  /// Serialises vkQueueSubmit2 between threads.
  void submit(const VkSubmitInfo2& info, VkFence fence);

 private:
  struct State;
  explicit Device(std::unique_ptr<State> state);
  void listen();  // to the validation layer
  std::function<void(const char*)> messageSink_;
  std::unique_ptr<State> state_;
};

/// Throws Error: OutOfMemory for the two out-of-memory results, DeviceFailure otherwise; `call` names the
/// function.
void check(VkResult result, const char* call);

}  // namespace vdi::gpu
