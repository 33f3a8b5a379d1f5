/* Loaded before a program (LD_PRELOAD). If the file VDI_TEST_LOSE_DEVICE exists, the library removes it, and
 * the Vulkan device for which the program waits next is lost. A folder of that name can't be removed, so each
 * device is lost. If the file VDI_TEST_NO_DEVICE exists, the library removes it when a program that has lost
 * a device asks for another one, which it doesn't get. While the file VDI_TEST_LOSE_STILLS exists, a device
 * is lost when any thread but the program's first waits for the 20th time. Threads that make full pictures
 * wait that often, strip by strip; threads that load VDIs don't. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>
#include <unistd.h>
#include <vulkan/vulkan.h>

enum { most = 64 };
static VkDevice lost[most];
static int lost_count = 0;
static __thread int waits = 0;

VKAPI_ATTR VkResult VKAPI_CALL vkWaitSemaphores(VkDevice device, const VkSemaphoreWaitInfo* info,
                                                uint64_t timeout) {
  const PFN_vkWaitSemaphores wait = (PFN_vkWaitSemaphores)dlsym(RTLD_NEXT, "vkWaitSemaphores");
  const VkResult result = wait(device, info, timeout);
  const char* name = getenv("VDI_TEST_LOSE_DEVICE");
  if (name != NULL && access(name, F_OK) == 0) {
    unlink(name);
    if (lost_count < most) lost[lost_count++] = device;
  }
  const char* stills = getenv("VDI_TEST_LOSE_STILLS");
  if (stills != NULL && gettid() != getpid() && ++waits >= 20 && access(stills, F_OK) == 0 &&
      lost_count < most)
    lost[lost_count++] = device;
  for (int i = 0; i < lost_count; ++i) {
    if (lost[i] == device) return VK_ERROR_DEVICE_LOST;
  }
  return result;
}

VKAPI_ATTR VkResult VKAPI_CALL vkCreateDevice(VkPhysicalDevice physical, const VkDeviceCreateInfo* info,
                                              const VkAllocationCallbacks* allocator, VkDevice* device) {
  const PFN_vkCreateDevice create = (PFN_vkCreateDevice)dlsym(RTLD_NEXT, "vkCreateDevice");
  const char* name = getenv("VDI_TEST_NO_DEVICE");
  if (name != NULL && lost_count > 0 && unlink(name) == 0) return VK_ERROR_INITIALIZATION_FAILED;
  return create(physical, info, allocator, device);
}

/* A new device may get the address of one that was destroyed. */
VKAPI_ATTR void VKAPI_CALL vkDestroyDevice(VkDevice device, const VkAllocationCallbacks* allocator) {
  const PFN_vkDestroyDevice destroy = (PFN_vkDestroyDevice)dlsym(RTLD_NEXT, "vkDestroyDevice");
  for (int i = 0; i < lost_count; ++i) {
    if (lost[i] == device) lost[i] = VK_NULL_HANDLE;
  }
  destroy(device, allocator);
}
