// A device that can be chosen: its properties, and the requirements that it doesn't meet.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <span>
#include <vector>

#include "vdi/gpu/DeviceChoice.h"
#include "vdi/gpu/DeviceLimits.h"

namespace vdi::gpu {

struct DeviceCandidate {
  VkPhysicalDevice handle = VK_NULL_HANDLE;
  std::uint32_t computeFamily = 0;
  std::uint32_t transferFamily = 0;
  DeviceLimits limits;
  DeviceSummary summary;
};

/// Queries all of these properties.
DeviceCandidate inspect(VkPhysicalDevice device);

std::vector<DeviceSummary> summariesOf(std::span<const DeviceCandidate> candidates);

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
