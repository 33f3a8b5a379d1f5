// A machine's devices: their properties, the requirements that they don't meet, and the choice among them.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "vdi/gpu/DeviceLimits.h"
#include "vdi/gpu/DeviceRequest.h"

namespace vdi::gpu {

/// Types in ascending order of preference.
enum class DeviceType { Other, Cpu, Virtual, Integrated, Discrete };

struct DeviceCandidate {
  VkPhysicalDevice handle = VK_NULL_HANDLE;
  std::string name;
  DeviceType type = DeviceType::Other;
  std::string driver;  // name and version
  std::uint32_t computeFamily = 0;
  std::uint32_t transferFamily = 0;
  DeviceLimits limits;
  std::vector<std::string> refusals;  // all requirements that it doesn't meet; empty: usable
};

/// Queries all of these properties.
DeviceCandidate inspect(VkPhysicalDevice device);

/// Returns a line per device: index, name, type, driver, memory, "usable" or the reason why it is not.
/// Without devices, returns one line that says so.
std::string describeDevices(std::span<const DeviceCandidate> devices);

/// The requested device; DeviceRequest and Device::create have the rules. Throws Error{DeviceUnavailable}
/// with the text of describeDevices.
const DeviceCandidate& chooseDevice(std::span<const DeviceCandidate> devices, const DeviceRequest& request);

/// The chain of feature structs, as one object that can be queried or passed to vkCreateDevice.
struct DeviceFeatures {
  VkPhysicalDeviceFeatures2 core{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, nullptr, {}};
  VkPhysicalDeviceVulkan11Features v11{};
  VkPhysicalDeviceVulkan12Features v12{};
  VkPhysicalDeviceVulkan13Features v13{};
  DeviceFeatures() {
    v11.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_FEATURES;
    v12.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES;
    v13.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES;
    core.pNext = &v11;
    v11.pNext = &v12;
    v12.pNext = &v13;
  }
  DeviceFeatures(const DeviceFeatures&) = delete;
  DeviceFeatures& operator=(const DeviceFeatures&) = delete;
};

}  // namespace vdi::gpu
