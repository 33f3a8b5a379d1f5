#include "vdi/gpu/DeviceCandidate.h"

#include <fmt/format.h>
#include <fmt/ranges.h>  // fmt::join

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <utility>

#include "vdi/core/Error.h"

namespace vdi::gpu {

namespace {

DeviceType typeOf(VkPhysicalDeviceType type) {
  switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      return DeviceType::Discrete;
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
      return DeviceType::Integrated;
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      return DeviceType::Virtual;
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
      return DeviceType::Cpu;
    default:
      return DeviceType::Other;
  }
}

std::uint64_t largestDeviceHeap(VkPhysicalDevice device) {
  VkPhysicalDeviceMemoryProperties memory;
  vkGetPhysicalDeviceMemoryProperties(device, &memory);
  std::uint64_t largest = 0;
  for (std::uint32_t i = 0; i < memory.memoryHeapCount; ++i) {
    if ((memory.memoryHeaps[i].flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT) != 0) {
      largest = std::max<std::uint64_t>(largest, memory.memoryHeaps[i].size);
    }
  }
  return largest;
}

/// Finds the queue families. Computing uses the first family with timestamps: on common hardware it also has
/// graphics and can use the whole device, while compute-only families may get a part of it. Transfers use a
/// family that can do nothing else (copy engines), if it copies boxes with any offset.
bool findFamilies(VkPhysicalDevice device, DeviceCandidate& candidate) {
  std::uint32_t count = 0;
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
  const auto compute = std::find_if(families.begin(), families.end(), [](const auto& family) {
    return (family.queueFlags & VK_QUEUE_COMPUTE_BIT) != 0 && family.timestampValidBits > 0;
  });
  if (compute == families.end()) return false;
  const auto transfer = std::find_if(families.begin(), families.end(), [](const auto& family) {
    const VkExtent3D& step = family.minImageTransferGranularity;
    return (family.queueFlags & VK_QUEUE_TRANSFER_BIT) != 0 &&
           (family.queueFlags & (VK_QUEUE_COMPUTE_BIT | VK_QUEUE_GRAPHICS_BIT)) == 0 && step.width == 1 &&
           step.height == 1 && step.depth == 1;
  });
  const auto indexOf = [&](auto family) { return static_cast<std::uint32_t>(family - families.begin()); };
  candidate.computeFamily = indexOf(compute);
  candidate.transferFamily = indexOf(transfer != families.end() ? transfer : compute);
  candidate.limits.timestampBits = compute->timestampValidBits;
  return true;
}

bool filtersLinearly(VkPhysicalDevice device, VkFormat format) {
  VkFormatProperties properties;
  vkGetPhysicalDeviceFormatProperties(device, format, &properties);
  constexpr VkFormatFeatureFlags wanted =
      VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT | VK_FORMAT_FEATURE_TRANSFER_DST_BIT;
  return (properties.optimalTilingFeatures & wanted) == wanted;
}

/// DeviceLimits::storesTexels.
bool storesTexels(VkPhysicalDevice device, const VkPhysicalDeviceFeatures& features) {
  constexpr std::array formats{VK_FORMAT_R8_UNORM, VK_FORMAT_R16_UNORM, VK_FORMAT_R32_SFLOAT};
  return features.shaderFloat64 == VK_TRUE && features.shaderStorageImageWriteWithoutFormat == VK_TRUE &&
         std::all_of(formats.begin(), formats.end(), [device](VkFormat format) {
           VkFormatProperties properties;
           vkGetPhysicalDeviceFormatProperties(device, format, &properties);
           return (properties.optimalTilingFeatures & VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT) != 0;
         });
}

/// DeviceLimits::hostPointerAlignment; 0 without VK_EXT_external_memory_host.
std::uint64_t hostPointerAlignment(VkPhysicalDevice device) {
  std::uint32_t count = 0;
  vkEnumerateDeviceExtensionProperties(device, nullptr, &count, nullptr);
  std::vector<VkExtensionProperties> extensions(count);
  vkEnumerateDeviceExtensionProperties(device, nullptr, &count, extensions.data());
  const bool there = std::any_of(extensions.begin(), extensions.end(), [](const VkExtensionProperties& e) {
    return std::strcmp(e.extensionName, VK_EXT_EXTERNAL_MEMORY_HOST_EXTENSION_NAME) == 0;
  });
  if (!there) return 0;
  VkPhysicalDeviceExternalMemoryHostPropertiesEXT host{
      VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_EXTERNAL_MEMORY_HOST_PROPERTIES_EXT, nullptr, 0};
  VkPhysicalDeviceProperties2 properties{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &host, {}};
  vkGetPhysicalDeviceProperties2(device, &properties);
  return host.minImportedHostPointerAlignment;
}

struct Subgroups {
  VkPhysicalDeviceVulkan13Properties v13{};
  VkPhysicalDeviceVulkan11Properties v11{};
  explicit Subgroups(VkPhysicalDevice device) {
    v13.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_PROPERTIES;
    v11.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_PROPERTIES;
    v11.pNext = &v13;
    VkPhysicalDeviceProperties2 properties{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &v11, {}};
    vkGetPhysicalDeviceProperties2(device, &properties);
  }
  /// Whether compute shaders support the operations.
  bool can(VkSubgroupFeatureFlags operations) const {
    return (v11.subgroupSupportedStages & VK_SHADER_STAGE_COMPUTE_BIT) != 0 &&
           (v11.subgroupSupportedOperations & operations) == operations;
  }
};

/// DeviceLimits::subgroupSize.
std::uint32_t usefulSubgroupSize(const Subgroups& subgroups, const DeviceFeatures& features) {
  const auto& v13 = subgroups.v13;
  constexpr VkSubgroupFeatureFlags needed =
      VK_SUBGROUP_FEATURE_BASIC_BIT | VK_SUBGROUP_FEATURE_BALLOT_BIT | VK_SUBGROUP_FEATURE_ARITHMETIC_BIT;
  constexpr std::uint32_t largest = 32;  // bits of a word
  const bool there = features.v13.subgroupSizeControl == VK_TRUE &&
                     features.v13.computeFullSubgroups == VK_TRUE &&
                     (v13.requiredSubgroupSizeStages & VK_SHADER_STAGE_COMPUTE_BIT) != 0 &&
                     subgroups.can(needed) && v13.minSubgroupSize <= largest;
  return there ? std::min(largest, v13.maxSubgroupSize) : 0;
}

/// Queries properties that need Vulkan 1.3: limits, driver, and missing requirements.
void inspectFeatures(VkPhysicalDevice device, DeviceCandidate& candidate) {
  VkPhysicalDeviceDriverProperties driver{};
  driver.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES;
  VkPhysicalDeviceMaintenance3Properties m3{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_3_PROPERTIES,
                                            &driver, 0, 0};
  VkPhysicalDeviceMaintenance4Properties m4{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_4_PROPERTIES, &m3,
                                            0};
  VkPhysicalDeviceProperties2 properties{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &m4, {}};
  vkGetPhysicalDeviceProperties2(device, &properties);
  candidate.driver = fmt::format("{} {}", driver.driverName, driver.driverInfo);
  DeviceLimits& limits = candidate.limits;
  limits.maxBufferBytes = m4.maxBufferSize;
  // Some drivers report 4 GiB as the largest allocation and make larger ones. Their largest buffer, which
  // they must be able to allocate, is the better figure.
  limits.maxAllocationBytes =
      std::min(limits.memoryBytes, std::max<std::uint64_t>(m3.maxMemoryAllocationSize, m4.maxBufferSize));

  limits.hostPointerAlignment = hostPointerAlignment(device);

  DeviceFeatures features;
  vkGetPhysicalDeviceFeatures2(device, &features.core);
  limits.shaderFloat16 = features.v12.shaderFloat16 == VK_TRUE;
  limits.storage16Bit = features.v11.storageBuffer16BitAccess == VK_TRUE;
  limits.storage8Bit = features.v12.storageBuffer8BitAccess == VK_TRUE;
  limits.storesTexels = storesTexels(device, features.core.features);
  const Subgroups subgroups(device);
  limits.subgroupSize = usefulSubgroupSize(subgroups, features);
  const bool shuffles = subgroups.can(VK_SUBGROUP_FEATURE_SHUFFLE_BIT);
  const std::array<std::pair<VkBool32, const char*>, 8> requirements{{
      {features.core.features.shaderInt64, "shaderInt64"},
      {features.v12.bufferDeviceAddress, "bufferDeviceAddress"},
      {features.v12.scalarBlockLayout, "scalarBlockLayout"},
      {features.v12.timelineSemaphore, "timelineSemaphore"},
      {features.v12.hostQueryReset, "hostQueryReset"},
      {features.v13.synchronization2, "synchronization2"},
      {features.v13.maintenance4, "maintenance4"},
      {shuffles ? VK_TRUE : VK_FALSE, "subgroup shuffles"},
  }};
  for (const auto& [present, name] : requirements) {
    if (present == VK_FALSE) candidate.refusals.push_back(fmt::format("no {}", name));
  }
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

const char* typeName(DeviceType type) {
  switch (type) {
    case DeviceType::Discrete:
      return "discrete";
    case DeviceType::Integrated:
      return "integrated";
    case DeviceType::Virtual:
      return "virtual";
    case DeviceType::Cpu:
      return "CPU";
    default:
      return "other";
  }
}

/// A number is an index: as part of a name, "7" would select a device by its driver's version.
bool selected(const DeviceCandidate& device, std::size_t index, const std::string& selector) {
  if (selector.empty()) return true;
  if (std::all_of(selector.begin(), selector.end(), [](unsigned char c) { return std::isdigit(c) != 0; })) {
    return std::to_string(index) == selector;
  }
  return lower(device.name).find(lower(selector)) != std::string::npos;
}

}  // namespace

DeviceCandidate inspect(VkPhysicalDevice device) {
  DeviceCandidate candidate;
  candidate.handle = device;
  VkPhysicalDeviceProperties properties;
  vkGetPhysicalDeviceProperties(device, &properties);
  DeviceLimits& limits = candidate.limits;
  limits.memoryBytes = largestDeviceHeap(device);
  limits.maxImageDimension3D = properties.limits.maxImageDimension3D;
  limits.timestampPeriodNs = properties.limits.timestampPeriod;
  std::copy_n(properties.limits.maxComputeWorkGroupCount, 3, limits.maxGroups.begin());

  candidate.name = properties.deviceName;
  candidate.type = typeOf(properties.deviceType);
  candidate.driver = fmt::format("driver {:#x}", properties.driverVersion);
  if (properties.apiVersion >= VK_API_VERSION_1_3) {
    inspectFeatures(device, candidate);
  } else {
    candidate.refusals.push_back(fmt::format("Vulkan {}.{}, but 1.3 is needed",
                                             VK_API_VERSION_MAJOR(properties.apiVersion),
                                             VK_API_VERSION_MINOR(properties.apiVersion)));
  }
  if (!findFamilies(device, candidate)) candidate.refusals.emplace_back("no compute queue with timestamps");
  for (const auto& [format, name] :
       {std::pair(VK_FORMAT_R8_UNORM, "R8_UNORM"), std::pair(VK_FORMAT_R16_UNORM, "R16_UNORM"),
        std::pair(VK_FORMAT_R32_SFLOAT, "R32_SFLOAT")}) {
    if (!filtersLinearly(device, format))
      candidate.refusals.push_back(fmt::format("no linear filtering of {}", name));
  }
  return candidate;
}

std::string describeDevices(std::span<const DeviceCandidate> devices) {
  if (devices.empty()) return "there is no Vulkan device: no driver (ICD) is installed or visible\n";
  std::string text;
  for (std::size_t i = 0; i < devices.size(); ++i) {
    const DeviceCandidate& d = devices[i];
    text += fmt::format("{}: {} ({}, {}, {} MiB): {}\n", i, d.name, typeName(d.type), d.driver,
                        d.limits.memoryBytes >> 20,
                        d.refusals.empty() ? "usable" : fmt::format("{}", fmt::join(d.refusals, ", ")));
  }
  return text;
}

const DeviceCandidate& chooseDevice(std::span<const DeviceCandidate> devices, const DeviceRequest& request) {
  std::vector<std::size_t> best;
  for (std::size_t i = 0; i < devices.size(); ++i) {
    if (!devices[i].refusals.empty() || !selected(devices[i], i, request.selector)) continue;
    if (!best.empty()) {
      const DeviceType before = devices[best.front()].type;
      if (devices[i].type < before) continue;
      if (devices[i].type > before) best.clear();
    }
    best.push_back(i);
  }
  if (best.empty()) {
    const std::string wanted =
        request.selector.empty() ? "" : fmt::format(" that matches VDI_DEVICE='{}'", request.selector);
    throw Error(ErrorCode::DeviceUnavailable, fmt::format("no usable Vulkan device{}; the devices are:\n{}",
                                                          wanted, describeDevices(devices)));
  }
  return devices[best[static_cast<std::size_t>(std::max(request.localRank, 0)) % best.size()]];
}

}  // namespace vdi::gpu
