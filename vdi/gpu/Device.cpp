#include "vdi/gpu/Device.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <utility>
#include <vector>

#include "vdi/core/Error.h"

namespace vdi::gpu {

namespace {

constexpr const char* validationLayer = "VK_LAYER_KHRONOS_validation";

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

const char* typeName(VkPhysicalDeviceType type) {
  switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      return "discrete";
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
      return "integrated";
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      return "virtual";
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
      return "CPU";
    default:
      return "other";
  }
}

int preference(VkPhysicalDeviceType type) {
  switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      return 4;
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
      return 3;
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      return 2;
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
      return 1;
    default:
      return 0;
  }
}

/// The chain of feature structs, as one object that can be queried or passed to vkCreateDevice.
struct Features {
  VkPhysicalDeviceFeatures2 core{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, nullptr, {}};
  VkPhysicalDeviceVulkan12Features v12{};
  VkPhysicalDeviceVulkan13Features v13{};
  Features() {
    v12.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES;
    v13.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES;
    core.pNext = &v12;
    v12.pNext = &v13;
  }
  Features(const Features&) = delete;
  Features& operator=(const Features&) = delete;
};

struct Candidate {
  VkPhysicalDevice handle = VK_NULL_HANDLE;
  VkPhysicalDeviceProperties properties{};
  std::uint32_t queueFamily = 0;
  std::uint64_t memoryBytes = 0;
  std::uint64_t maxAllocationBytes = 0;
  std::vector<std::string> refusals;
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

/// Prefers the family with graphics, which on common hardware is the one with the most compute queues.
bool findComputeFamily(VkPhysicalDevice device, std::uint32_t& family) {
  std::uint32_t count = 0;
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
  for (std::uint32_t i = 0; i < count; ++i) {
    if ((families[i].queueFlags & VK_QUEUE_COMPUTE_BIT) != 0 && families[i].timestampValidBits > 0) {
      family = i;
      return true;
    }
  }
  return false;
}

bool filtersLinearly(VkPhysicalDevice device, VkFormat format) {
  VkFormatProperties properties;
  vkGetPhysicalDeviceFormatProperties(device, format, &properties);
  constexpr VkFormatFeatureFlags wanted =
      VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT | VK_FORMAT_FEATURE_TRANSFER_DST_BIT;
  return (properties.optimalTilingFeatures & wanted) == wanted;
}

Candidate inspect(VkPhysicalDevice device) {
  Candidate candidate;
  candidate.handle = device;
  vkGetPhysicalDeviceProperties(device, &candidate.properties);
  candidate.memoryBytes = largestDeviceHeap(device);
  auto& refusals = candidate.refusals;
  if (candidate.properties.apiVersion < VK_API_VERSION_1_3) {
    refusals.push_back(fmt::format("Vulkan {}.{}, 1.3 is needed",
                                   VK_API_VERSION_MAJOR(candidate.properties.apiVersion),
                                   VK_API_VERSION_MINOR(candidate.properties.apiVersion)));
    return candidate;
  }
  VkPhysicalDeviceMaintenance3Properties m3{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_3_PROPERTIES,
                                            nullptr, 0, 0};
  VkPhysicalDeviceMaintenance4Properties m4{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_4_PROPERTIES, &m3,
                                            0};
  VkPhysicalDeviceProperties2 properties{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &m4, {}};
  vkGetPhysicalDeviceProperties2(device, &properties);
  // Several drivers report 4 GiB here and allocate more; what's really there decides. The Vulkan limits of
  // buffers stay.
  candidate.maxAllocationBytes = std::max<std::uint64_t>(m3.maxMemoryAllocationSize, m4.maxBufferSize);
  Features features;
  vkGetPhysicalDeviceFeatures2(device, &features.core);
  const std::array<std::pair<VkBool32, const char*>, 7> demands{{
      {features.core.features.shaderInt64, "shaderInt64"},
      {features.v12.bufferDeviceAddress, "bufferDeviceAddress"},
      {features.v12.scalarBlockLayout, "scalarBlockLayout"},
      {features.v12.timelineSemaphore, "timelineSemaphore"},
      {features.v12.hostQueryReset, "hostQueryReset"},
      {features.v13.synchronization2, "synchronization2"},
      {features.v13.maintenance4, "maintenance4"},
  }};
  for (const auto& [present, name] : demands) {
    if (present == VK_FALSE) refusals.push_back(fmt::format("no {}", name));
  }
  if (!findComputeFamily(device, candidate.queueFamily))
    refusals.emplace_back("no compute queue with timestamps");
  for (const auto& [format, name] :
       {std::pair(VK_FORMAT_R8_UNORM, "R8_UNORM"), std::pair(VK_FORMAT_R16_UNORM, "R16_UNORM"),
        std::pair(VK_FORMAT_R32_SFLOAT, "R32_SFLOAT")}) {
    if (!filtersLinearly(device, format)) refusals.push_back(fmt::format("no linear filtering of {}", name));
  }
  return candidate;
}

std::string describe(const std::vector<Candidate>& candidates) {
  if (candidates.empty()) return "there is no Vulkan device: no driver (ICD) is installed or visible\n";
  std::string text;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Candidate& c = candidates[i];
    text += fmt::format("{}: {} ({}, {} MiB): {}\n", i, c.properties.deviceName,
                        typeName(c.properties.deviceType), c.memoryBytes >> 20,
                        c.refusals.empty() ? "usable" : fmt::format("{}", fmt::join(c.refusals, ", ")));
  }
  return text;
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

  std::vector<Candidate> candidates() const {
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

bool selected(const Candidate& candidate, std::size_t index, const std::string& selector) {
  if (selector.empty()) return true;
  if (std::all_of(selector.begin(), selector.end(), [](unsigned char c) { return std::isdigit(c) != 0; })) {
    return std::to_string(index) == selector;
  }
  return lower(candidate.properties.deviceName).find(lower(selector)) != std::string::npos;
}

const Candidate& choose(const std::vector<Candidate>& candidates, const DeviceRequest& request) {
  std::vector<const Candidate*> best;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Candidate& c = candidates[i];
    if (!c.refusals.empty() || !selected(c, i, request.selector)) continue;
    const int rank = preference(c.properties.deviceType);
    if (!best.empty() && rank < preference(best.front()->properties.deviceType)) continue;
    if (!best.empty() && rank > preference(best.front()->properties.deviceType)) best.clear();
    best.push_back(&c);
  }
  if (best.empty()) {
    const std::string wanted =
        request.selector.empty() ? "" : fmt::format(" that matches VDI_DEVICE='{}'", request.selector);
    throw Error(ErrorCode::DeviceUnavailable,
                fmt::format("no usable Vulkan device{}; the devices are:\n{}", wanted, describe(candidates)));
  }
  return *best[static_cast<std::size_t>(std::max(request.localRank, 0)) % best.size()];
}

}  // namespace

struct Device::State {
  VkInstance instance = VK_NULL_HANDLE;
  VkDebugUtilsMessengerEXT messenger = VK_NULL_HANDLE;
  VkPhysicalDevice physical = VK_NULL_HANDLE;
  VkDevice device = VK_NULL_HANDLE;
  VkQueue queue = VK_NULL_HANDLE;
  VkPipelineCache cache = VK_NULL_HANDLE;
  std::uint32_t queueFamily = 0;
  std::string name;
  bool cpu = false;
  DeviceLimits limits;
  VkPhysicalDeviceMemoryProperties memory{};
  std::atomic<std::int64_t> allocated{0};
  std::mutex queueMutex;
  mutable std::mutex messageMutex;
  std::uint32_t messageCount = 0;
  std::string messages;

  ~State() {
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

namespace {

VKAPI_ATTR VkBool32 VKAPI_CALL onMessage(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                         VkDebugUtilsMessageTypeFlagsEXT,
                                         const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
  auto* sink = static_cast<std::function<void(const char*)>*>(user);
  (*sink)(data->pMessage);
  return VK_FALSE;
}

}  // namespace

void check(VkResult result, const char* call) {
  if (result == VK_SUCCESS) return;
  const bool memory = result == VK_ERROR_OUT_OF_DEVICE_MEMORY || result == VK_ERROR_OUT_OF_HOST_MEMORY;
  throw Error(memory ? ErrorCode::OutOfMemory : ErrorCode::DeviceFailure,
              fmt::format("{} failed with VkResult {}", call, static_cast<int>(result)));
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
  if (instance.result() != VK_SUCCESS) return describe({});
  return describe(instance.candidates());
}

std::shared_ptr<Device> Device::create(const DeviceRequest& request) {
  Instance instance(request.validation);
  if (instance.result() == VK_ERROR_LAYER_NOT_PRESENT) {
    throw Error(ErrorCode::DeviceUnavailable, "validation was asked for, but its layer isn't installed",
                validationLayer);
  }
  const std::vector<Candidate> candidates =
      instance.result() == VK_SUCCESS ? instance.candidates() : std::vector<Candidate>();
  const Candidate& chosen = choose(candidates, request);

  auto state = std::make_unique<State>();
  state->instance = instance.release();
  state->physical = chosen.handle;
  state->queueFamily = chosen.queueFamily;
  state->name = chosen.properties.deviceName;
  state->cpu = chosen.properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
  state->limits = {chosen.memoryBytes, std::min(chosen.maxAllocationBytes, chosen.memoryBytes),
                   chosen.properties.limits.maxImageDimension3D, chosen.properties.limits.timestampPeriod};
  vkGetPhysicalDeviceMemoryProperties(chosen.handle, &state->memory);

  const float priority = 1.0F;
  const VkDeviceQueueCreateInfo queueInfo{
      VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO, nullptr, 0, chosen.queueFamily, 1, &priority};
  Features features;
  features.core.features.shaderInt64 = VK_TRUE;
  features.v12.bufferDeviceAddress = VK_TRUE;
  features.v12.scalarBlockLayout = VK_TRUE;
  features.v12.timelineSemaphore = VK_TRUE;
  features.v12.hostQueryReset = VK_TRUE;
  features.v13.synchronization2 = VK_TRUE;
  features.v13.maintenance4 = VK_TRUE;
  VkDeviceCreateInfo info{VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
                          &features.core,
                          0,
                          1,
                          &queueInfo,
                          0,
                          nullptr,
                          0,
                          nullptr,
                          nullptr};
  check(vkCreateDevice(chosen.handle, &info, nullptr, &state->device), "vkCreateDevice");
  vkGetDeviceQueue(state->device, chosen.queueFamily, 0, &state->queue);
  const VkPipelineCacheCreateInfo cacheInfo{VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO, nullptr, 0, 0,
                                            nullptr};
  check(vkCreatePipelineCache(state->device, &cacheInfo, nullptr, &state->cache), "vkCreatePipelineCache");
  std::shared_ptr<Device> device(new Device(std::move(state)));
  if (request.validation) device->listen();
  return device;
}

Device::Device(std::unique_ptr<State> state) : state_(std::move(state)) {}

Device::~Device() {
  if (state_->device != VK_NULL_HANDLE) vkDeviceWaitIdle(state_->device);
}

void Device::listen() {
  messageSink_ = [state = state_.get()](const char* text) {
    const std::lock_guard lock(state->messageMutex);
    ++state->messageCount;
    if (state->messages.size() < 65536) state->messages += std::string(text) + "\n";
  };
  const VkDebugUtilsMessengerCreateInfoEXT info{
      VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT,
      nullptr,
      0,
      VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT,
      VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT,
      onMessage,
      &messageSink_};
  const auto create = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
      vkGetInstanceProcAddr(state_->instance, "vkCreateDebugUtilsMessengerEXT"));
  check(create == nullptr ? VK_ERROR_EXTENSION_NOT_PRESENT
                          : create(state_->instance, &info, nullptr, &state_->messenger),
        "vkCreateDebugUtilsMessengerEXT");
}

const std::string& Device::name() const {
  return state_->name;
}
bool Device::isCpu() const {
  return state_->cpu;
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
VkQueue Device::queue() const {
  return state_->queue;
}
std::uint32_t Device::queueFamily() const {
  return state_->queueFamily;
}
VkPipelineCache Device::pipelineCache() const {
  return state_->cache;
}

std::uint32_t Device::memoryType(std::uint32_t typeBits, VkMemoryPropertyFlags wanted) const {
  for (std::uint32_t i = 0; i < state_->memory.memoryTypeCount; ++i) {
    const bool allowed = (typeBits & (1U << i)) != 0;
    if (allowed && (state_->memory.memoryTypes[i].propertyFlags & wanted) == wanted) return i;
  }
  throw Error(ErrorCode::OutOfMemory, fmt::format("no memory type with properties {:#x}", wanted), name());
}

std::uint64_t Device::allocatedBytes() const {
  return static_cast<std::uint64_t>(state_->allocated.load());
}
void Device::accountAllocation(std::int64_t bytes) {
  state_->allocated += bytes;
}

std::uint32_t Device::validationMessageCount() const {
  const std::lock_guard lock(state_->messageMutex);
  return state_->messageCount;
}

std::string Device::validationMessages() const {
  const std::lock_guard lock(state_->messageMutex);
  return state_->messages;
}

void Device::submit(const VkSubmitInfo2& info, VkFence fence) {
  const std::lock_guard lock(state_->queueMutex);
  check(vkQueueSubmit2(state_->queue, 1, &info, fence), "vkQueueSubmit2");
}

}  // namespace vdi::gpu
