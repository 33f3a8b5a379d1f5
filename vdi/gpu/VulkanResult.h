// What Vulkan's functions return, as exceptions.
#pragma once

#include <vulkan/vulkan.h>

#include <string>

namespace vdi::gpu {

/// As Vulkan's C headers spell it.
std::string nameOf(VkResult result);

/// Throws Error: OutOfMemory for the two out-of-memory results, DeviceFailure otherwise; `call` names the
/// function.
void check(VkResult result, const char* call);

}  // namespace vdi::gpu
