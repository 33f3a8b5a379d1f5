// Which of a machine's devices to use: the part of Device::create that needs no Vulkan call.
#pragma once

#include <vulkan/vulkan.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace vdi::gpu {

struct DeviceRequest;

struct DeviceSummary {
  std::string name;
  VkPhysicalDeviceType type = VK_PHYSICAL_DEVICE_TYPE_OTHER;
  std::string driver;                 // name and version
  std::uint64_t memoryBytes = 0;      // of the largest device-local heap
  std::vector<std::string> refusals;  // everything that's demanded and missing; empty: usable
};

/// A line per device: index, name, type, driver, memory, "usable" or why not. One line that says so when
/// there's no device.
std::string describeDevices(std::span<const DeviceSummary> devices);

/// Index of the device that the request asks for; see DeviceRequest and Device::create for the rules. Throws
/// Error{DeviceUnavailable} with describeDevices' text.
std::size_t chooseDevice(std::span<const DeviceSummary> devices, const DeviceRequest& request);

}  // namespace vdi::gpu
