#include "vdi/gpu/Device.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <utility>
#include <vector>

#include "vdi/core/Error.h"
#include "vdi/gpu/DeviceChoice.h"

namespace vdi::gpu {

namespace {

constexpr const char* validationLayer = "VK_LAYER_KHRONOS_validation";

/// The chain of feature structs, as one object that can be queried or passed to vkCreateDevice.
struct Features {
  VkPhysicalDeviceFeatures2 core{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, nullptr, {}};
  VkPhysicalDeviceVulkan11Features v11{};
  VkPhysicalDeviceVulkan12Features v12{};
  VkPhysicalDeviceVulkan13Features v13{};
  Features() {
    v11.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_FEATURES;
    v12.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES;
    v13.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES;
    core.pNext = &v11;
    v11.pNext = &v12;
    v12.pNext = &v13;
  }
  Features(const Features&) = delete;
  Features& operator=(const Features&) = delete;
};

struct Candidate {
  VkPhysicalDevice handle = VK_NULL_HANDLE;
  std::uint32_t computeFamily = 0;
  std::uint32_t transferFamily = 0;
  DeviceLimits limits;
  DeviceSummary summary;
};

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

/// The first family that computes and has timestamps: the one with graphics on common hardware, which has the
/// whole device, while compute-only families may share it. For transfers one that can do nothing else, copy
/// engines, if it copies boxes of any texels.
bool findFamilies(VkPhysicalDevice device, Candidate& candidate) {
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

/// 0 without VK_EXT_external_memory_host.
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
  /// In compute shaders.
  bool can(VkSubgroupFeatureFlags operations) const {
    return (v11.subgroupSupportedStages & VK_SHADER_STAGE_COMPUTE_BIT) != 0 &&
           (v11.subgroupSupportedOperations & operations) == operations;
  }
};

/// DeviceLimits::subgroupSize.
std::uint32_t usefulSubgroupSize(const Subgroups& subgroups, const Features& features) {
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

/// What needs Vulkan 1.3 to be asked for: limits, driver, and what's missing.
void inspectFeatures(VkPhysicalDevice device, Candidate& candidate) {
  VkPhysicalDeviceDriverProperties driver{};
  driver.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES;
  VkPhysicalDeviceMaintenance3Properties m3{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_3_PROPERTIES,
                                            &driver, 0, 0};
  VkPhysicalDeviceMaintenance4Properties m4{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_4_PROPERTIES, &m3,
                                            0};
  VkPhysicalDeviceProperties2 properties{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &m4, {}};
  vkGetPhysicalDeviceProperties2(device, &properties);
  candidate.summary.driver = fmt::format("{} {}", driver.driverName, driver.driverInfo);
  DeviceLimits& limits = candidate.limits;
  limits.maxBufferBytes = m4.maxBufferSize;
  // Some drivers report 4 GiB as the largest allocation and make larger ones: there the largest buffer, which
  // they'd have to allocate, tells more.
  limits.maxAllocationBytes =
      std::min(limits.memoryBytes, std::max<std::uint64_t>(m3.maxMemoryAllocationSize, m4.maxBufferSize));

  limits.hostPointerAlignment = hostPointerAlignment(device);

  Features features;
  vkGetPhysicalDeviceFeatures2(device, &features.core);
  limits.shaderFloat16 = features.v12.shaderFloat16 == VK_TRUE;
  limits.storage16Bit = features.v11.storageBuffer16BitAccess == VK_TRUE;
  limits.storage8Bit = features.v12.storageBuffer8BitAccess == VK_TRUE;
  const Subgroups subgroups(device);
  limits.subgroupSize = usefulSubgroupSize(subgroups, features);
  const bool shuffles = subgroups.can(VK_SUBGROUP_FEATURE_SHUFFLE_BIT);
  const std::array<std::pair<VkBool32, const char*>, 8> demands{{
      {features.core.features.shaderInt64, "shaderInt64"},
      {features.v12.bufferDeviceAddress, "bufferDeviceAddress"},
      {features.v12.scalarBlockLayout, "scalarBlockLayout"},
      {features.v12.timelineSemaphore, "timelineSemaphore"},
      {features.v12.hostQueryReset, "hostQueryReset"},
      {features.v13.synchronization2, "synchronization2"},
      {features.v13.maintenance4, "maintenance4"},
      {shuffles ? VK_TRUE : VK_FALSE, "subgroup shuffles"},
  }};
  for (const auto& [present, name] : demands) {
    if (present == VK_FALSE) candidate.summary.refusals.push_back(fmt::format("no {}", name));
  }
}

Candidate inspect(VkPhysicalDevice device) {
  Candidate candidate;
  candidate.handle = device;
  VkPhysicalDeviceProperties properties;
  vkGetPhysicalDeviceProperties(device, &properties);
  DeviceLimits& limits = candidate.limits;
  limits.memoryBytes = largestDeviceHeap(device);
  limits.maxImageDimension3D = properties.limits.maxImageDimension3D;
  limits.timestampPeriodNs = properties.limits.timestampPeriod;
  std::copy_n(properties.limits.maxComputeWorkGroupCount, 3, limits.maxGroups.begin());

  DeviceSummary& summary = candidate.summary;
  summary.name = properties.deviceName;
  summary.type = properties.deviceType;
  summary.memoryBytes = limits.memoryBytes;
  summary.driver = fmt::format("driver {:#x}", properties.driverVersion);
  if (properties.apiVersion >= VK_API_VERSION_1_3) {
    inspectFeatures(device, candidate);
  } else {
    summary.refusals.push_back(fmt::format("Vulkan {}.{}, 1.3 is needed",
                                           VK_API_VERSION_MAJOR(properties.apiVersion),
                                           VK_API_VERSION_MINOR(properties.apiVersion)));
  }
  if (!findFamilies(device, candidate)) summary.refusals.emplace_back("no compute queue with timestamps");
  for (const auto& [format, name] :
       {std::pair(VK_FORMAT_R8_UNORM, "R8_UNORM"), std::pair(VK_FORMAT_R16_UNORM, "R16_UNORM"),
        std::pair(VK_FORMAT_R32_SFLOAT, "R32_SFLOAT")}) {
    if (!filtersLinearly(device, format))
      summary.refusals.push_back(fmt::format("no linear filtering of {}", name));
  }
  return candidate;
}

std::vector<DeviceSummary> summaries(const std::vector<Candidate>& candidates) {
  std::vector<DeviceSummary> result;
  result.reserve(candidates.size());
  for (const Candidate& candidate : candidates) result.push_back(candidate.summary);
  return result;
}

/// The validation layer's messages.
class MessageLog {
 public:
  void add(const char* text) {
    const std::lock_guard lock(mutex_);
    ++count_;
    text_ += text;
    text_ += '\n';
    if (text_.size() > kept) text_.erase(0, text_.size() - kept);
  }
  std::uint32_t count() const {
    const std::lock_guard lock(mutex_);
    return count_;
  }
  std::string text() const {
    const std::lock_guard lock(mutex_);
    return text_;
  }

 private:
  static constexpr std::size_t kept = 65536;
  mutable std::mutex mutex_;
  std::uint32_t count_ = 0;
  std::string text_;
};

VKAPI_ATTR VkBool32 VKAPI_CALL onMessage(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                         VkDebugUtilsMessageTypeFlagsEXT,
                                         const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
  static_cast<MessageLog*>(user)->add(data->pMessage);
  return VK_FALSE;
}

/// VkInstance with RAII, so that construction can fail half-way.
class Instance {
 public:
  explicit Instance(bool validation) {
    VkApplicationInfo application{
        VK_STRUCTURE_TYPE_APPLICATION_INFO, nullptr, "pv-vdi", 0, nullptr, 0, VK_API_VERSION_1_3};
    VkInstanceCreateInfo info{
        VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO, nullptr, 0, &application, 0, nullptr, 0, nullptr};
    const char* extension = VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
    if (validation) {
      info.enabledLayerCount = 1;
      info.ppEnabledLayerNames = &validationLayer;
      info.enabledExtensionCount = 1;
      info.ppEnabledExtensionNames = &extension;
    }
    result_ = vkCreateInstance(&info, nullptr, &handle_);
  }
  ~Instance() {
    if (handle_ != VK_NULL_HANDLE) vkDestroyInstance(handle_, nullptr);
  }
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;
  VkResult result() const { return result_; }
  VkInstance handle() const { return handle_; }
  VkInstance release() { return std::exchange(handle_, VK_NULL_HANDLE); }

  /// Empty without an instance, which is what the loader gives when there's no driver at all.
  std::vector<Candidate> candidates() const {
    if (handle_ == VK_NULL_HANDLE) return {};
    std::uint32_t count = 0;
    if (vkEnumeratePhysicalDevices(handle_, &count, nullptr) != VK_SUCCESS) return {};
    std::vector<VkPhysicalDevice> devices(count);
    vkEnumeratePhysicalDevices(handle_, &count, devices.data());
    std::vector<Candidate> result;
    result.reserve(devices.size());
    for (VkPhysicalDevice device : devices) result.push_back(inspect(device));
    return result;
  }

 private:
  VkInstance handle_ = VK_NULL_HANDLE;
  VkResult result_ = VK_SUCCESS;
};

}  // namespace

struct Device::State {
  VkInstance instance = VK_NULL_HANDLE;
  VkDebugUtilsMessengerEXT messenger = VK_NULL_HANDLE;
  VkPhysicalDevice physical = VK_NULL_HANDLE;
  VkDevice device = VK_NULL_HANDLE;
  struct Queue {
    VkQueue handle = VK_NULL_HANDLE;
    std::uint32_t family = 0;
    // Timeline: counts submissions that are done. It lives as long as the device because drivers may touch it
    // a moment longer than the submission takes: Mesa 22.3's queue thread does.
    VkSemaphore done = VK_NULL_HANDLE;
    std::uint64_t submissions = 0;
  };
  std::array<Queue, 2> queues;  // by kind
  VkPipelineCache cache = VK_NULL_HANDLE;
  std::string name;
  bool cpu = false;
  bool gpuPrograms = true;
  DeviceLimits limits;
  VkPhysicalDeviceMemoryProperties memory{};
  std::atomic<std::int64_t> allocated{0};
  std::mutex queueMutex;
  MessageLog log;
  PFN_vkGetMemoryHostPointerPropertiesEXT hostPointerProperties = nullptr;

  void listen();  // to the validation layer
  Queue& queue(QueueKind kind) { return queues[static_cast<std::size_t>(kind)]; }

  ~State() {
    for (const Queue& queue : queues) {
      if (queue.done != VK_NULL_HANDLE) vkDestroySemaphore(device, queue.done, nullptr);
    }
    if (cache != VK_NULL_HANDLE) vkDestroyPipelineCache(device, cache, nullptr);
    if (device != VK_NULL_HANDLE) vkDestroyDevice(device, nullptr);
    if (messenger != VK_NULL_HANDLE) {
      const auto destroy = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
          vkGetInstanceProcAddr(instance, "vkDestroyDebugUtilsMessengerEXT"));
      if (destroy != nullptr) destroy(instance, messenger, nullptr);
    }
    if (instance != VK_NULL_HANDLE) vkDestroyInstance(instance, nullptr);
  }
};

void Device::State::listen() {
  const VkDebugUtilsMessengerCreateInfoEXT info{
      VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT,
      nullptr,
      0,
      VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT,
      VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT,
      onMessage,
      &log};
  const auto create = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
      vkGetInstanceProcAddr(instance, "vkCreateDebugUtilsMessengerEXT"));
  check(create == nullptr ? VK_ERROR_EXTENSION_NOT_PRESENT : create(instance, &info, nullptr, &messenger),
        "vkCreateDebugUtilsMessengerEXT");
}

namespace {

std::string resultName(VkResult result) {
  switch (result) {
    case VK_NOT_READY:
      return "VK_NOT_READY";
    case VK_TIMEOUT:
      return "VK_TIMEOUT";
    case VK_INCOMPLETE:
      return "VK_INCOMPLETE";
    case VK_ERROR_OUT_OF_HOST_MEMORY:
      return "VK_ERROR_OUT_OF_HOST_MEMORY";
    case VK_ERROR_OUT_OF_DEVICE_MEMORY:
      return "VK_ERROR_OUT_OF_DEVICE_MEMORY";
    case VK_ERROR_INITIALIZATION_FAILED:
      return "VK_ERROR_INITIALIZATION_FAILED";
    case VK_ERROR_DEVICE_LOST:
      return "VK_ERROR_DEVICE_LOST";
    case VK_ERROR_MEMORY_MAP_FAILED:
      return "VK_ERROR_MEMORY_MAP_FAILED";
    case VK_ERROR_LAYER_NOT_PRESENT:
      return "VK_ERROR_LAYER_NOT_PRESENT";
    case VK_ERROR_EXTENSION_NOT_PRESENT:
      return "VK_ERROR_EXTENSION_NOT_PRESENT";
    case VK_ERROR_FEATURE_NOT_PRESENT:
      return "VK_ERROR_FEATURE_NOT_PRESENT";
    case VK_ERROR_INCOMPATIBLE_DRIVER:
      return "VK_ERROR_INCOMPATIBLE_DRIVER";
    case VK_ERROR_TOO_MANY_OBJECTS:
      return "VK_ERROR_TOO_MANY_OBJECTS";
    case VK_ERROR_FORMAT_NOT_SUPPORTED:
      return "VK_ERROR_FORMAT_NOT_SUPPORTED";
    default:
      return fmt::format("VkResult {}", static_cast<int>(result));
  }
}

/// A device of its own for the process, with every feature that `limits` and Device::create promise.
VkDevice makeDevice(const Candidate& chosen) {
  const float priority = 1.0F;
  const auto queueOf = [&priority](std::uint32_t family) {
    return VkDeviceQueueCreateInfo{
        VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO, nullptr, 0, family, 1, &priority};
  };
  const std::array queues{queueOf(chosen.computeFamily), queueOf(chosen.transferFamily)};
  Features features;
  features.core.features.shaderInt64 = VK_TRUE;
  features.v11.storageBuffer16BitAccess = chosen.limits.storage16Bit ? VK_TRUE : VK_FALSE;
  features.v12.storageBuffer8BitAccess = chosen.limits.storage8Bit ? VK_TRUE : VK_FALSE;
  features.v12.shaderFloat16 = chosen.limits.shaderFloat16 ? VK_TRUE : VK_FALSE;
  features.v12.bufferDeviceAddress = VK_TRUE;
  features.v12.scalarBlockLayout = VK_TRUE;
  features.v12.timelineSemaphore = VK_TRUE;
  features.v12.hostQueryReset = VK_TRUE;
  features.v13.synchronization2 = VK_TRUE;
  features.v13.maintenance4 = VK_TRUE;
  features.v13.subgroupSizeControl = chosen.limits.subgroupSize > 0 ? VK_TRUE : VK_FALSE;
  features.v13.computeFullSubgroups = chosen.limits.subgroupSize > 0 ? VK_TRUE : VK_FALSE;
  VkDeviceCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
  info.pNext = &features.core;
  info.queueCreateInfoCount = chosen.computeFamily == chosen.transferFamily ? 1 : 2;
  info.pQueueCreateInfos = queues.data();
  const char* hostMemory = VK_EXT_EXTERNAL_MEMORY_HOST_EXTENSION_NAME;
  if (chosen.limits.hostPointerAlignment > 0) {
    info.enabledExtensionCount = 1;
    info.ppEnabledExtensionNames = &hostMemory;
  }
  VkDevice device = VK_NULL_HANDLE;
  const VkResult result = vkCreateDevice(chosen.handle, &info, nullptr, &device);
  if (result != VK_SUCCESS) {  // in use exclusively, reset, unplugged, ...
    throw Error(
        ErrorCode::DeviceUnavailable,
        fmt::format("the Vulkan device can't be opened: vkCreateDevice failed with {}", resultName(result)),
        chosen.summary.name);
  }
  return device;
}

}  // namespace

void check(VkResult result, const char* call) {
  if (result == VK_SUCCESS) return;
  const bool memory = result == VK_ERROR_OUT_OF_DEVICE_MEMORY || result == VK_ERROR_OUT_OF_HOST_MEMORY;
  throw Error(memory ? ErrorCode::OutOfMemory : ErrorCode::DeviceFailure,
              fmt::format("{} failed with {}", call, resultName(result)));
}

DeviceRequest requestFromEnvironment(int localRank) {
  DeviceRequest request;
  request.localRank = localRank;
  if (const char* selector = std::getenv("VDI_DEVICE")) request.selector = selector;
  const char* validation = std::getenv("VDI_VALIDATION");
  request.validation = validation != nullptr && std::strcmp(validation, "1") == 0;
  return request;
}

std::string Device::describeAll() {
  const Instance instance(false);
  return describeDevices(summaries(instance.candidates()));
}

std::shared_ptr<Device> Device::create(const DeviceRequest& request) {
  Instance instance(request.validation);
  if (request.validation && (instance.result() == VK_ERROR_LAYER_NOT_PRESENT ||
                             instance.result() == VK_ERROR_EXTENSION_NOT_PRESENT)) {
    throw Error(
        ErrorCode::DeviceUnavailable,
        fmt::format("validation was asked for, but isn't installed: {}", resultName(instance.result())),
        validationLayer);
  }
  // The loader's answer to a machine without a driver is VK_ERROR_INCOMPATIBLE_DRIVER.
  if (instance.result() != VK_SUCCESS && instance.result() != VK_ERROR_INCOMPATIBLE_DRIVER) {
    throw Error(ErrorCode::DeviceUnavailable,
                fmt::format("vkCreateInstance failed with {}", resultName(instance.result())));
  }
  const std::vector<Candidate> candidates = instance.candidates();
  const Candidate& chosen = candidates[chooseDevice(summaries(candidates), request)];

  auto state = std::make_unique<State>();
  state->instance = instance.release();
  if (request.validation) state->listen();
  state->physical = chosen.handle;
  state->queue(QueueKind::Compute).family = chosen.computeFamily;
  state->queue(QueueKind::Transfer).family = chosen.transferFamily;
  state->name = chosen.summary.name;
  state->cpu = chosen.summary.type == VK_PHYSICAL_DEVICE_TYPE_CPU;
  state->gpuPrograms = !state->cpu || request.gpuPrograms;
  state->limits = chosen.limits;
  if (!request.importsHostMemory) state->limits.hostPointerAlignment = 0;
  if (request.mostImageDimension3D > 0) {
    state->limits.maxImageDimension3D =
        std::min(state->limits.maxImageDimension3D, request.mostImageDimension3D);
  }
  vkGetPhysicalDeviceMemoryProperties(chosen.handle, &state->memory);
  state->device = makeDevice(chosen);
  const VkSemaphoreTypeCreateInfo timeline{VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO, nullptr,
                                           VK_SEMAPHORE_TYPE_TIMELINE, 0};
  const VkSemaphoreCreateInfo semaphoreInfo{VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO, &timeline, 0};
  for (State::Queue& queue : state->queues) {
    vkGetDeviceQueue(state->device, queue.family, 0, &queue.handle);
    check(vkCreateSemaphore(state->device, &semaphoreInfo, nullptr, &queue.done), "vkCreateSemaphore");
  }
  if (state->limits.hostPointerAlignment > 0) {
    state->hostPointerProperties = reinterpret_cast<PFN_vkGetMemoryHostPointerPropertiesEXT>(
        vkGetDeviceProcAddr(state->device, "vkGetMemoryHostPointerPropertiesEXT"));
  }
  const VkPipelineCacheCreateInfo cacheInfo{VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO, nullptr, 0, 0,
                                            nullptr};
  check(vkCreatePipelineCache(state->device, &cacheInfo, nullptr, &state->cache), "vkCreatePipelineCache");
  return std::shared_ptr<Device>(new Device(std::move(state)));
}

Device::Device(std::unique_ptr<State> state) : state_(std::move(state)) {}

Device::~Device() {
  if (state_->device != VK_NULL_HANDLE) vkDeviceWaitIdle(state_->device);
}

const std::string& Device::name() const {
  return state_->name;
}
bool Device::isCpu() const {
  return state_->cpu;
}
bool Device::runsGpuPrograms() const {
  return state_->gpuPrograms;
}
const DeviceLimits& Device::limits() const {
  return state_->limits;
}
VkInstance Device::instance() const {
  return state_->instance;
}
VkPhysicalDevice Device::physicalDevice() const {
  return state_->physical;
}
VkDevice Device::handle() const {
  return state_->device;
}
std::uint32_t Device::queueFamily(QueueKind kind) const {
  return state_->queue(kind).family;
}
VkPipelineCache Device::pipelineCache() const {
  return state_->cache;
}

std::optional<std::uint32_t> Device::findMemoryType(std::uint32_t typeBits,
                                                    VkMemoryPropertyFlags wanted) const {
  for (std::uint32_t i = 0; i < state_->memory.memoryTypeCount; ++i) {
    const bool allowed = (typeBits & (1U << i)) != 0;
    if (allowed && (state_->memory.memoryTypes[i].propertyFlags & wanted) == wanted) return i;
  }
  return std::nullopt;
}

std::uint32_t Device::memoryType(std::uint32_t typeBits, VkMemoryPropertyFlags wanted) const {
  const auto type = findMemoryType(typeBits, wanted);
  if (!type)
    throw Error(ErrorCode::OutOfMemory, fmt::format("no memory type with properties {:#x}", wanted), name());
  return *type;
}

std::uint32_t Device::memoryTypesOfHostPointer(const void* pages) const {
  if (state_->hostPointerProperties == nullptr) return 0;
  VkMemoryHostPointerPropertiesEXT properties{VK_STRUCTURE_TYPE_MEMORY_HOST_POINTER_PROPERTIES_EXT, nullptr,
                                              0};
  const VkResult result = state_->hostPointerProperties(
      state_->device, VK_EXTERNAL_MEMORY_HANDLE_TYPE_HOST_ALLOCATION_BIT_EXT, pages, &properties);
  return result == VK_SUCCESS ? properties.memoryTypeBits : 0;
}

std::uint64_t Device::allocatedBytes() const {
  return static_cast<std::uint64_t>(state_->allocated.load());
}
void Device::accountAllocation(std::int64_t bytes) {
  state_->allocated += bytes;
}

std::uint32_t Device::validationMessageCount() const {
  return state_->log.count();
}
std::string Device::validationMessages() const {
  return state_->log.text();
}

std::uint64_t Device::submit(QueueKind kind, std::span<const VkSemaphoreSubmitInfo> waits,
                             VkCommandBuffer commands) {
  const VkCommandBufferSubmitInfo buffer{VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO, nullptr, commands, 0};
  const std::lock_guard lock(state_->queueMutex);
  State::Queue& queue = state_->queue(kind);
  const VkSemaphoreSubmitInfo done{
      VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO, nullptr, queue.done, queue.submissions + 1,
      VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT,    0};
  const VkSubmitInfo2 info{VK_STRUCTURE_TYPE_SUBMIT_INFO_2,
                           nullptr,
                           0,
                           static_cast<std::uint32_t>(waits.size()),
                           waits.data(),
                           1,
                           &buffer,
                           1,
                           &done};
  check(vkQueueSubmit2(queue.handle, 1, &info, VK_NULL_HANDLE), "vkQueueSubmit2");
  return ++queue.submissions;
}

void Device::wait(QueueKind kind, std::uint64_t submissions) const {
  const VkSemaphoreWaitInfo info{
      VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO, nullptr, 0, 1, &state_->queue(kind).done, &submissions};
  check(vkWaitSemaphores(state_->device, &info, UINT64_MAX), "vkWaitSemaphores");
}

VkSemaphore Device::submissionsDone(QueueKind kind) const {
  return state_->queue(kind).done;
}

}  // namespace vdi::gpu
