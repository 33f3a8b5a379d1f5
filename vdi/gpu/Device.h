// A compute device, through Vulkan. Generators, renderers and everything else made from it keep it alive.
// This header needs no Vulkan header.
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
  /// says that there is no Vulkan driver, that the validation layer is missing, or that the device cannot be
  /// opened. The device must have Vulkan 1.3, a compute queue with timestamps, hostQueryReset,
  /// bufferDeviceAddress, scalarBlockLayout, shaderInt64, timelineSemaphore, synchronization2, maintenance4,
  /// subgroup shuffles, and linear filtering of 3-D R32_SFLOAT, R16_UNORM and R8_UNORM images. The order of
  /// preference is discrete, integrated, virtual, CPU.
  static std::shared_ptr<Device> create(const DeviceRequest& request);
  /// Returns a line per device: index, name, type, driver, memory, "usable" or the reason why it is not.
  /// Throws Error{DeviceUnavailable} if Vulkan is installed but unusable.
  static std::string describeAll();

  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  Device(Device&&) = delete;
  Device& operator=(Device&&) = delete;

  const std::string& name() const;  // as the driver reports it
  bool isCpu() const;               // lavapipe, for example
  /// Whether to choose programs that do more work in order to wait less, as GPUs need. Results are the same.
  bool runsGpuPrograms() const;
  const DeviceLimits& limits() const;
  /// Whether the device was lost. It stays lost: create another one.
  bool isLost() const;

  /// Bytes of device memory that this device's users hold.
  std::uint64_t allocatedBytes() const;

  /// Number of validation messages so far, and the text of the latest ones (64 KiB); 0 and empty without
  /// validation.
  std::uint32_t validationMessageCount() const;
  std::string validationMessages() const;

  /// For the library's own code: no installed header has the type.
  VulkanDevice& vulkan() const;

 private:
  struct State;
  explicit Device(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace vdi::gpu
