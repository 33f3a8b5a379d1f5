#include "vdi/gpu/VulkanDevice.h"

#include <fmt/format.h>

#include <new>
#include <vector>

#include "vdi/core/Error.h"
#include "vdi/gpu/DeviceCandidate.h"
#include "vdi/gpu/Instance.h"
#include "vdi/gpu/VulkanResult.h"

namespace vdi::gpu {

namespace {

/// A device private to this process, with every feature that `limits` and Device::create promise.
VkDevice makeDevice(const DeviceCandidate& chosen) {
  const float priority = 1.0F;
  const auto queueOf = [&priority](std::uint32_t family) {
    return VkDeviceQueueCreateInfo{
        VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO, nullptr, 0, family, 1, &priority};
  };
  const std::array queues{queueOf(chosen.computeFamily), queueOf(chosen.transferFamily)};
  DeviceFeatures features;
  features.core.features.shaderInt64 = VK_TRUE;
  features.core.features.shaderFloat64 = chosen.limits.storesTexels ? VK_TRUE : VK_FALSE;
  features.core.features.shaderStorageImageWriteWithoutFormat =
      chosen.limits.storesTexels ? VK_TRUE : VK_FALSE;
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
        fmt::format("the Vulkan device can't be opened: vkCreateDevice failed with {}", nameOf(result)),
        chosen.name);
  }
  return device;
}

}  // namespace

VulkanDevice::VulkanDevice(const Instance& instance, const DeviceCandidate& chosen,
                           const std::string& cacheFolder)
    : name_(chosen.name),
      device_(makeDevice(chosen)),
      cacheFile_(cacheFolder, pipelineCacheKeyOf(chosen.handle)) {
  queue(QueueKind::Compute).family = chosen.computeFamily;
  queue(QueueKind::Transfer).family = chosen.transferFamily;
  vkGetPhysicalDeviceMemoryProperties(chosen.handle, &memory_);
  if (chosen.limits.hostPointerAlignment > 0) {
    hostPointerProperties_ = reinterpret_cast<PFN_vkGetMemoryHostPointerPropertiesEXT>(
        vkGetDeviceProcAddr(device_, "vkGetMemoryHostPointerPropertiesEXT"));
  }
  if (instance.validates()) {
    const auto find = [&](const char* name) { return vkGetInstanceProcAddr(instance.handle(), name); };
    names_ = {reinterpret_cast<PFN_vkSetDebugUtilsObjectNameEXT>(find("vkSetDebugUtilsObjectNameEXT")),
              reinterpret_cast<PFN_vkCmdBeginDebugUtilsLabelEXT>(find("vkCmdBeginDebugUtilsLabelEXT")),
              reinterpret_cast<PFN_vkCmdEndDebugUtilsLabelEXT>(find("vkCmdEndDebugUtilsLabelEXT"))};
  }
  try {
    setUp();
  } catch (...) {
    release();
    throw;
  }
}

void VulkanDevice::setUp() {
  const VkSemaphoreTypeCreateInfo timeline{VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO, nullptr,
                                           VK_SEMAPHORE_TYPE_TIMELINE, 0};
  const VkSemaphoreCreateInfo semaphoreInfo{VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO, &timeline, 0};
  for (Queue& queue : queues_) {
    vkGetDeviceQueue(device_, queue.family, 0, &queue.handle);
    check(vkCreateSemaphore(device_, &semaphoreInfo, nullptr, &queue.done), "vkCreateSemaphore");
  }
  const std::vector<std::byte> cached = cacheFile_.read();
  cachedBytes_ = cached.size();
  const VkPipelineCacheCreateInfo cacheInfo{VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO, nullptr, 0,
                                            cached.size(), cached.data()};
  check(vkCreatePipelineCache(device_, &cacheInfo, nullptr, &cache_), "vkCreatePipelineCache");
}

VulkanDevice::~VulkanDevice() {
  vkDeviceWaitIdle(device_);
  if (!lost_) saveCache();
  release();
}

/// Writes the compiled shaders to the cache's file if their size differs from that of the file's data.
void VulkanDevice::saveCache() const noexcept {
  try {
    std::size_t bytes = 0;
    if (vkGetPipelineCacheData(device_, cache_, &bytes, nullptr) != VK_SUCCESS || bytes == cachedBytes_)
      return;
    std::vector<std::byte> data(bytes);
    if (vkGetPipelineCacheData(device_, cache_, &bytes, data.data()) == VK_SUCCESS)
      cacheFile_.write(std::span(data).first(bytes));
  } catch (const std::bad_alloc&) {  // the next run compiles again
  }
}

void VulkanDevice::release() noexcept {
  for (const Queue& queue : queues_) {
    if (queue.done != VK_NULL_HANDLE) vkDestroySemaphore(device_, queue.done, nullptr);
  }
  compiled_.clear();
  if (cache_ != VK_NULL_HANDLE) vkDestroyPipelineCache(device_, cache_, nullptr);
  vkDestroyDevice(device_, nullptr);
}

std::shared_ptr<const CompiledPipeline> VulkanDevice::compiled(const ComputePipelineInfo& info,
                                                               std::uint32_t subgroupSize) {
  const PipelineTarget target{device_, cache_, subgroupSize};
  const bool isOurs = info.code.empty();
  const auto name = [&](const CompiledPipeline& pipeline) {
    const std::string text(isOurs ? info.shader : "a shader without a name");
    setName(VK_OBJECT_TYPE_PIPELINE, pipeline.handle(), text);
    setName(VK_OBJECT_TYPE_PIPELINE_LAYOUT, pipeline.layout(), "layout of " + text);
  };
  if (isOurs) return compiled_.of(target, info, name);
  auto pipeline = std::make_shared<const CompiledPipeline>(target, info);
  name(*pipeline);
  return pipeline;
}

std::optional<std::uint32_t> VulkanDevice::findMemoryType(std::uint32_t typeBits,
                                                          VkMemoryPropertyFlags wanted) const {
  for (std::uint32_t i = 0; i < memory_.memoryTypeCount; ++i) {
    const bool allowed = (typeBits & (1U << i)) != 0;
    if (allowed && (memory_.memoryTypes[i].propertyFlags & wanted) == wanted) return i;
  }
  return std::nullopt;
}

std::uint32_t VulkanDevice::memoryType(std::uint32_t typeBits, VkMemoryPropertyFlags wanted) const {
  const auto type = findMemoryType(typeBits, wanted);
  if (!type)
    throw Error(ErrorCode::OutOfMemory, fmt::format("no memory type with properties {:#x}", wanted), name_);
  return *type;
}

std::uint32_t VulkanDevice::memoryTypesOfHostPointer(const void* pages) const {
  if (hostPointerProperties_ == nullptr) return 0;
  VkMemoryHostPointerPropertiesEXT properties{VK_STRUCTURE_TYPE_MEMORY_HOST_POINTER_PROPERTIES_EXT, nullptr,
                                              0};
  const VkResult result = hostPointerProperties_(
      device_, VK_EXTERNAL_MEMORY_HANDLE_TYPE_HOST_ALLOCATION_BIT_EXT, pages, &properties);
  return result == VK_SUCCESS ? properties.memoryTypeBits : 0;
}

void VulkanDevice::checkForLoss(VkResult result, const char* call) const {
  if (result == VK_ERROR_DEVICE_LOST) lost_ = true;
  check(result, call);
}

std::uint64_t VulkanDevice::submit(QueueKind kind, std::span<const VkSemaphoreSubmitInfo> waits,
                                   VkCommandBuffer commands) {
  const VkCommandBufferSubmitInfo buffer{VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO, nullptr, commands, 0};
  const std::lock_guard lock(queueMutex_);
  Queue& target = queue(kind);
  const VkSemaphoreSubmitInfo done{
      VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO, nullptr, target.done, target.submissions + 1,
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
  checkForLoss(vkQueueSubmit2(target.handle, 1, &info, VK_NULL_HANDLE), "vkQueueSubmit2");
  return ++target.submissions;
}

void VulkanDevice::setNameOf(VkObjectType type, std::uint64_t handle, const std::string& name) const {
  const VkDebugUtilsObjectNameInfoEXT info{VK_STRUCTURE_TYPE_DEBUG_UTILS_OBJECT_NAME_INFO_EXT, nullptr, type,
                                           handle, name.c_str()};
  check(names_.set(device_, &info), "vkSetDebugUtilsObjectNameEXT");
}

void VulkanDevice::beginLabel(VkCommandBuffer commands, const std::string& name) const {
  if (names_.begin == nullptr) return;
  const VkDebugUtilsLabelEXT label{
      VK_STRUCTURE_TYPE_DEBUG_UTILS_LABEL_EXT, nullptr, name.c_str(), {0.0F, 0.0F, 0.0F, 0.0F}};
  names_.begin(commands, &label);
}

void VulkanDevice::endLabel(VkCommandBuffer commands) const {
  if (names_.end != nullptr) names_.end(commands);
}

void VulkanDevice::wait(QueueKind kind, std::uint64_t submissions) const {
  const VkSemaphore done = queue(kind).done;
  const VkSemaphoreWaitInfo info{VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO, nullptr, 0, 1, &done, &submissions};
  checkForLoss(vkWaitSemaphores(device_, &info, UINT64_MAX), "vkWaitSemaphores");
}

}  // namespace vdi::gpu
