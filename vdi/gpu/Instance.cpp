#include "vdi/gpu/Instance.h"

#include <fmt/format.h>

#include "vdi/core/Error.h"
#include "vdi/gpu/VulkanResult.h"

namespace vdi::gpu {

namespace {

constexpr const char* validationLayer = "VK_LAYER_KHRONOS_validation";

VKAPI_ATTR VkBool32 VKAPI_CALL onMessage(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                         VkDebugUtilsMessageTypeFlagsEXT,
                                         const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
  static_cast<MessageLog*>(user)->add(data->pMessage);
  return VK_FALSE;
}

}  // namespace

Instance::Instance(bool validation) {
  const VkApplicationInfo application{
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
  const VkResult result = vkCreateInstance(&info, nullptr, &handle_);
  if (validation && (result == VK_ERROR_LAYER_NOT_PRESENT || result == VK_ERROR_EXTENSION_NOT_PRESENT)) {
    throw Error(
        ErrorCode::DeviceUnavailable,
        fmt::format("VDI_VALIDATION is set, but the validation layer isn't installed: {}", nameOf(result)),
        validationLayer);
  }
  // The loader returns this on a machine without a driver.
  if (result == VK_ERROR_INCOMPATIBLE_DRIVER) {
    handle_ = VK_NULL_HANDLE;
    return;
  }
  if (result != VK_SUCCESS) {
    throw Error(ErrorCode::DeviceUnavailable, fmt::format("vkCreateInstance failed with {}", nameOf(result)));
  }
  if (validation) listen();
}

void Instance::listen() {
  const VkDebugUtilsMessengerCreateInfoEXT info{
      VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT,
      nullptr,
      0,
      VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT,
      VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT,
      onMessage,
      &log_};
  const auto create = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
      vkGetInstanceProcAddr(handle_, "vkCreateDebugUtilsMessengerEXT"));
  const VkResult result =
      create == nullptr ? VK_ERROR_EXTENSION_NOT_PRESENT : create(handle_, &info, nullptr, &messenger_);
  if (result == VK_SUCCESS) return;
  vkDestroyInstance(handle_, nullptr);
  check(result, "vkCreateDebugUtilsMessengerEXT");
}

Instance::~Instance() {
  if (messenger_ != VK_NULL_HANDLE) {
    const auto destroy = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
        vkGetInstanceProcAddr(handle_, "vkDestroyDebugUtilsMessengerEXT"));
    if (destroy != nullptr) destroy(handle_, messenger_, nullptr);
  }
  if (handle_ != VK_NULL_HANDLE) vkDestroyInstance(handle_, nullptr);
}

std::vector<DeviceCandidate> Instance::candidates() const {
  if (handle_ == VK_NULL_HANDLE) return {};
  std::uint32_t count = 0;
  if (vkEnumeratePhysicalDevices(handle_, &count, nullptr) != VK_SUCCESS) return {};
  std::vector<VkPhysicalDevice> devices(count);
  vkEnumeratePhysicalDevices(handle_, &count, devices.data());
  std::vector<DeviceCandidate> result;
  result.reserve(devices.size());
  for (VkPhysicalDevice device : devices) result.push_back(inspect(device));
  return result;
}

}  // namespace vdi::gpu
