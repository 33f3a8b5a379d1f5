// One Vulkan device with one compute queue. Everything else in vdi/gpu is made from it and keeps it alive.
#pragma once

#include <vulkan/vulkan.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

namespace vdi::gpu {

struct DeviceRequest {
  /// Index (as `vdi info --devices` lists them) or part of the name, case-insensitive; digits alone are
  /// always an index. Empty: all devices. The best of those is used; equal ones are dealt out by localRank.
  std::string selector;
  int localRank = 0;        // rank among the ranks of this node
  bool validation = false;  // VK_LAYER_KHRONOS_validation; every message of severity warning or error is kept
  /// Runs what's the fastest on GPUs on a CPU too, so that it can be tested there; see
  /// Device::runsGpuPrograms.
  bool gpuPrograms = false;
  /// A smaller limit than the device's own, so that what is cut to fit can be tested; 0: the device's.
  std::uint32_t mostImageDimension3D = 0;
  /// False: as a device that can't import the process's memory, so that what goes without it can be tested.
  bool importsHostMemory = true;
};

/// The request that the environment asks for: VDI_DEVICE is the selector, VDI_VALIDATION=1 turns validation
/// on.
DeviceRequest requestFromEnvironment(int localRank);

struct DeviceLimits {
  std::uint64_t memoryBytes = 0;  // of the largest device-local heap
  /// The most that's worth asking for in one allocation: the larger of maxMemoryAllocationSize and
  /// maxBufferSize, at most memoryBytes. The driver may still refuse it.
  std::uint64_t maxAllocationBytes = 0;
  std::uint64_t maxBufferBytes = 0;
  std::uint32_t maxImageDimension3D = 0;
  std::array<std::uint32_t, 3> maxGroups{};  // of one dispatch, per axis
  float timestampPeriodNs = 0.0F;
  std::uint32_t timestampBits = 0;  // the low ones that count; the clock wraps around
  /// What the start and the size of host memory that's imported must be multiples of; 0: the device can't.
  std::uint64_t hostPointerAlignment = 0;
  /// Invocations of a subgroup, for compute shaders whose subgroups vote and add up: they can be told to have
  /// just that many (ComputePipelineInfo::wholeSubgroups), 32 at most. 0 if they can't.
  std::uint32_t subgroupSize = 0;
  // Features that are turned on where the device has them.
  bool shaderFloat16 = false;
  bool storage16Bit = false;  // storageBuffer16BitAccess
  bool storage8Bit = false;   // storageBuffer8BitAccess
};

/// What a queue is for. Where the hardware has copy engines, Transfer is theirs: what's submitted there goes
/// on beside what computes. Elsewhere both are the same queue.
enum class QueueKind { Compute, Transfer };

class Device {
 public:
  /// Throws Error{DeviceUnavailable}; the text lists every device of the machine and why it was refused, or
  /// says that there's no Vulkan driver at all, that the validation layer is missing, or that the device
  /// can't be opened. What's demanded: Vulkan 1.3, a compute queue with timestamps, hostQueryReset,
  /// bufferDeviceAddress, scalarBlockLayout, shaderInt64, timelineSemaphore, synchronization2, maintenance4,
  /// subgroup shuffles, linear filtering of 3-D R32_SFLOAT, R16_UNORM and R8_UNORM images. Preference:
  /// discrete, integrated, virtual, CPU.
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
  /// Whether programs are chosen that do more work to wait less: true for GPUs. The results are the same.
  bool runsGpuPrograms() const;
  const DeviceLimits& limits() const;

  VkInstance instance() const;
  VkPhysicalDevice physicalDevice() const;
  VkDevice handle() const;
  std::uint32_t queueFamily(QueueKind kind = QueueKind::Compute) const;
  VkPipelineCache pipelineCache() const;

  /// Index of the first memory type that `typeBits` allows and that has `wanted`, if there's one; by Vulkan's
  /// order that's the one with the fewest other properties.
  std::optional<std::uint32_t> findMemoryType(std::uint32_t typeBits, VkMemoryPropertyFlags wanted) const;
  /// The same; throws Error{OutOfMemory} if there's none.
  std::uint32_t memoryType(std::uint32_t typeBits, VkMemoryPropertyFlags wanted) const;
  /// Memory types as which memory of the process at `pages`, aligned to hostPointerAlignment, can be
  /// imported; 0: none.
  std::uint32_t memoryTypesOfHostPointer(const void* pages) const;
  /// Bytes of device memory that Buffers and Images of this device hold now.
  std::uint64_t allocatedBytes() const;
  void accountAllocation(std::int64_t bytes);

  /// Number of validation messages so far, and the text of the latest ones (64 KiB). 0 and empty without
  /// validation.
  std::uint32_t validationMessageCount() const;
  std::string validationMessages() const;

  /// Submits to a queue; the result is how many submissions that queue has had, this one included, which is
  /// what its timeline semaphore reaches when this one is done. From any thread.
  std::uint64_t submit(QueueKind kind, std::span<const VkSemaphoreSubmitInfo> waits,
                       VkCommandBuffer commands);
  /// Waits for that many. Throws Error{DeviceFailure} on device loss.
  void wait(QueueKind kind, std::uint64_t submissions) const;
  /// For `waits` of submit.
  VkSemaphore submissionsDone(QueueKind kind) const;

 private:
  struct State;
  explicit Device(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Throws Error: OutOfMemory for the two out-of-memory results, DeviceFailure otherwise; `call` names the
/// function.
void check(VkResult result, const char* call);

}  // namespace vdi::gpu
