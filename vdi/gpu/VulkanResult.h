// Results of Vulkan's functions as exceptions.
#pragma once

#include <vulkan/vulkan.h>

#include <string>

namespace vdi::gpu {

/// The name of the result in Vulkan's C headers.
std::string nameOf(VkResult result);

/// Throws Error for results other than success: OutOfMemory for the two out-of-memory results, else
/// DeviceFailure. `call` names the function.
void check(VkResult result, const char* call);

}  // namespace vdi::gpu
