#include "vdi/gpu/VulkanResult.h"

#include <fmt/format.h>

#include <cctype>
#include <vulkan/vulkan.hpp>

#include "vdi/core/Error.h"

namespace vdi::gpu {

// Converts, for example, vulkan.hpp's ErrorDeviceLost to VK_ERROR_DEVICE_LOST.
std::string nameOf(VkResult result) {
  std::string name = "VK";
  bool wasLower = true;
  for (const char c : vk::to_string(static_cast<vk::Result>(result))) {
    const auto letter = static_cast<unsigned char>(c);
    if (wasLower && std::isupper(letter) != 0) name += '_';
    wasLower = std::isupper(letter) == 0;
    name += static_cast<char>(std::toupper(letter));
  }
  return name;
}

void check(VkResult result, const char* call) {
  if (result == VK_SUCCESS) return;
  const bool memory = result == VK_ERROR_OUT_OF_DEVICE_MEMORY || result == VK_ERROR_OUT_OF_HOST_MEMORY;
  throw Error(memory ? ErrorCode::OutOfMemory : ErrorCode::DeviceFailure,
              fmt::format("{} failed with {}", call, nameOf(result)));
}

}  // namespace vdi::gpu
