// One device for computing, through Vulkan. Everything else in vdi/gpu is made from it and keeps it alive.
// Its users need no Vulkan header.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "vdi/gpu/DeviceLimits.h"
#include "vdi/gpu/DeviceRequest.h"

namespace vdi::gpu {

class VulkanDevice;

class Device {
 public:
  /// Throws Error{DeviceUnavailable}; the text lists every device of the machine and why it was refused, or
  /// says that there's no Vulkan driver at all, that the validation layer is missing, or that the device
  /// can't be opened. What's required: Vulkan 1.3, a compute queue with timestamps, hostQueryReset,
  /// bufferDeviceAddress, scalarBlockLayout, shaderInt64, timelineSemaphore, synchronization2, maintenance4,
  /// subgroup shuffles, linear filtering of 3-D R32_SFLOAT, R16_UNORM and R8_UNORM images. Preference:
  /// discrete, integrated, virtual, CPU.
  static std::shared_ptr<Device> create(const DeviceRequest& request);
  /// A line per device: index, name, type, driver, memory, "usable" or why not. Throws
  /// Error{DeviceUnavailable} if there's Vulkan, but can't be had.
  static std::string describeAll();

  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  Device(Device&&) = delete;
  Device& operator=(Device&&) = delete;

  const std::string& name() const;  // as the driver gives it
  bool isCpu() const;               // lavapipe, for example
  /// Whether programs are chosen that do more work to wait less: true for GPUs. The results are the same.
  bool runsGpuPrograms() const;
  const DeviceLimits& limits() const;
  /// Whether its work has failed with a loss. It stays lost: another one must be created.
  bool isLost() const;

  /// Bytes of device memory that Buffers and Images of this device hold now.
  std::uint64_t allocatedBytes() const;
  void accountAllocation(std::int64_t bytes);

  /// Number of validation messages so far, and the text of the latest ones (64 KiB). 0 and empty without
  /// validation.
  std::uint32_t validationMessageCount() const;
  std::string validationMessages() const;

  /// For the rest of vdi/gpu.
  VulkanDevice& vulkan() const;

 private:
  struct State;
  explicit Device(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace vdi::gpu
