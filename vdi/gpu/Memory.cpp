#include "vdi/gpu/Memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "vdi/core/Error.h"
#include "vdi/gpu/Device.h"

namespace vdi::gpu {

namespace {

constexpr std::uint64_t smallestBuffer = 16;

/// Memory for a resource; throws with the figures that a user needs.
VkDeviceMemory allocate(Device& device, const VkMemoryRequirements& needs, std::uint32_t type,
                        const void* chain) {
  const VkMemoryAllocateInfo info{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, chain, needs.size, type};
  VkDeviceMemory memory = VK_NULL_HANDLE;
  const VkResult result = vkAllocateMemory(device.handle(), &info, nullptr, &memory);
  if (result == VK_ERROR_OUT_OF_DEVICE_MEMORY || result == VK_ERROR_OUT_OF_HOST_MEMORY) {
    throw Error(
        ErrorCode::OutOfMemory,
        fmt::format("{} MiB of device memory were refused; {} MiB of {} MiB are in use by this process",
                    needs.size >> 20, device.allocatedBytes() >> 20, device.limits().memoryBytes >> 20),
        device.name());
  }
  check(result, "vkAllocateMemory");
  device.accountAllocation(static_cast<std::int64_t>(needs.size));
  return memory;
}

void demandFits(const Device& device, std::uint64_t bytes) {
  if (bytes > device.limits().maxAllocationBytes) {
    throw Error(ErrorCode::OutOfMemory,
                fmt::format("one allocation of {} MiB is more than the device's limit of {} MiB", bytes >> 20,
                            device.limits().maxAllocationBytes >> 20),
                device.name());
  }
}

std::uint32_t memoryTypeFor(const Device& device, std::uint32_t typeBits, MemoryKind kind) {
  constexpr VkMemoryPropertyFlags host =
      VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  if (kind == MemoryKind::DeviceLocal)
    return device.memoryType(typeBits, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
  if (kind == MemoryKind::Upload) return device.memoryType(typeBits, host);
  try {
    return device.memoryType(typeBits, host | VK_MEMORY_PROPERTY_HOST_CACHED_BIT);
  } catch (const Error&) {
    return device.memoryType(typeBits, host);
  }
}

}  // namespace

Buffer::Buffer(std::shared_ptr<Device> device, std::uint64_t bytes, MemoryKind kind)
    : device_(std::move(device)), size_(std::max(bytes, smallestBuffer)) {
  demandFits(*device_, size_);
  try {
    const VkBufferCreateInfo info{VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO,
                                  nullptr,
                                  0,
                                  size_,
                                  VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT |
                                      VK_BUFFER_USAGE_TRANSFER_DST_BIT |
                                      VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT,
                                  VK_SHARING_MODE_EXCLUSIVE,
                                  0,
                                  nullptr};
    check(vkCreateBuffer(device_->handle(), &info, nullptr, &buffer_), "vkCreateBuffer");
    VkMemoryRequirements needs;
    vkGetBufferMemoryRequirements(device_->handle(), buffer_, &needs);
    const VkMemoryAllocateFlagsInfo flags{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO, nullptr,
                                          VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT, 0};
    memory_ = allocate(*device_, needs, memoryTypeFor(*device_, needs.memoryTypeBits, kind), &flags);
    allocated_ = needs.size;
    check(vkBindBufferMemory(device_->handle(), buffer_, memory_, 0), "vkBindBufferMemory");
    const VkBufferDeviceAddressInfo addressInfo{VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO, nullptr,
                                                buffer_};
    address_ = vkGetBufferDeviceAddress(device_->handle(), &addressInfo);
    if (kind != MemoryKind::DeviceLocal) {
      void* data = nullptr;
      check(vkMapMemory(device_->handle(), memory_, 0, VK_WHOLE_SIZE, 0, &data), "vkMapMemory");
      mapped_ = {static_cast<std::byte*>(data), size_};
    }
  } catch (...) {
    release();
    throw;
  }
}

Buffer::~Buffer() {
  release();
}

Buffer::Buffer(Buffer&& other) noexcept {
  *this = std::move(other);
}

Buffer& Buffer::operator=(Buffer&& other) noexcept {
  if (this == &other) return *this;
  release();
  device_ = std::move(other.device_);
  buffer_ = std::exchange(other.buffer_, VK_NULL_HANDLE);
  memory_ = std::exchange(other.memory_, VK_NULL_HANDLE);
  size_ = std::exchange(other.size_, 0);
  allocated_ = std::exchange(other.allocated_, 0);
  address_ = std::exchange(other.address_, 0);
  mapped_ = std::exchange(other.mapped_, {});
  return *this;
}

bool Buffer::reserve(const std::shared_ptr<Device>& device, std::uint64_t bytes, MemoryKind kind) {
  if (buffer_ != VK_NULL_HANDLE && size_ >= bytes) return false;
  const bool grows = buffer_ != VK_NULL_HANDLE;
  release();
  const std::uint64_t roomy = std::min(bytes + bytes / 2, device->limits().maxAllocationBytes);
  *this = Buffer(device, grows ? std::max(bytes, roomy) : bytes, kind);
  return true;
}

void Buffer::release() noexcept {
  if (!device_) return;
  if (buffer_ != VK_NULL_HANDLE) vkDestroyBuffer(device_->handle(), buffer_, nullptr);
  if (memory_ != VK_NULL_HANDLE) vkFreeMemory(device_->handle(), memory_, nullptr);
  device_->accountAllocation(-static_cast<std::int64_t>(allocated_));
  buffer_ = VK_NULL_HANDLE;
  memory_ = VK_NULL_HANDLE;
  size_ = 0;
  allocated_ = 0;
  address_ = 0;
  mapped_ = {};
  device_.reset();
}

Image3D::Image3D(std::shared_ptr<Device> device, const glm::uvec3& extent, VkFormat format)
    : device_(std::move(device)), extent_(extent), format_(format) {
  const std::uint32_t longest = device_->limits().maxImageDimension3D;
  if (glm::any(glm::greaterThan(extent, glm::uvec3(longest)))) {
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("a texture of {} x {} x {} is beyond the device's {} per axis", extent.x,
                            extent.y, extent.z, longest),
                device_->name());
  }
  try {
    const VkImageCreateInfo info{VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO,
                                 nullptr,
                                 0,
                                 VK_IMAGE_TYPE_3D,
                                 format,
                                 {extent.x, extent.y, extent.z},
                                 1,
                                 1,
                                 VK_SAMPLE_COUNT_1_BIT,
                                 VK_IMAGE_TILING_OPTIMAL,
                                 VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT,
                                 VK_SHARING_MODE_EXCLUSIVE,
                                 0,
                                 nullptr,
                                 VK_IMAGE_LAYOUT_UNDEFINED};
    check(vkCreateImage(device_->handle(), &info, nullptr, &image_), "vkCreateImage");
    VkMemoryRequirements needs;
    vkGetImageMemoryRequirements(device_->handle(), image_, &needs);
    memory_ = allocate(*device_, needs,
                       memoryTypeFor(*device_, needs.memoryTypeBits, MemoryKind::DeviceLocal), nullptr);
    allocated_ = needs.size;
    check(vkBindImageMemory(device_->handle(), image_, memory_, 0), "vkBindImageMemory");
    const VkImageViewCreateInfo viewInfo{
        VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO, nullptr, 0, image_, VK_IMAGE_VIEW_TYPE_3D, format, {},
        {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1}};
    check(vkCreateImageView(device_->handle(), &viewInfo, nullptr, &view_), "vkCreateImageView");
  } catch (...) {
    release();
    throw;
  }
}

Image3D::~Image3D() {
  release();
}

Image3D::Image3D(Image3D&& other) noexcept {
  *this = std::move(other);
}

Image3D& Image3D::operator=(Image3D&& other) noexcept {
  if (this == &other) return *this;
  release();
  device_ = std::move(other.device_);
  image_ = std::exchange(other.image_, VK_NULL_HANDLE);
  view_ = std::exchange(other.view_, VK_NULL_HANDLE);
  memory_ = std::exchange(other.memory_, VK_NULL_HANDLE);
  allocated_ = std::exchange(other.allocated_, 0);
  extent_ = other.extent_;
  format_ = other.format_;
  return *this;
}

void Image3D::release() noexcept {
  if (!device_) return;
  if (view_ != VK_NULL_HANDLE) vkDestroyImageView(device_->handle(), view_, nullptr);
  if (image_ != VK_NULL_HANDLE) vkDestroyImage(device_->handle(), image_, nullptr);
  if (memory_ != VK_NULL_HANDLE) vkFreeMemory(device_->handle(), memory_, nullptr);
  device_->accountAllocation(-static_cast<std::int64_t>(allocated_));
  view_ = VK_NULL_HANDLE;
  image_ = VK_NULL_HANDLE;
  memory_ = VK_NULL_HANDLE;
  allocated_ = 0;
  device_.reset();
}

Sampler::Sampler(std::shared_ptr<Device> device) : device_(std::move(device)) {
  VkSamplerCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO;
  info.magFilter = VK_FILTER_LINEAR;
  info.minFilter = VK_FILTER_LINEAR;
  info.mipmapMode = VK_SAMPLER_MIPMAP_MODE_NEAREST;
  info.addressModeU = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
  info.addressModeV = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
  info.addressModeW = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
  check(vkCreateSampler(device_->handle(), &info, nullptr, &sampler_), "vkCreateSampler");
}

Sampler::~Sampler() {
  vkDestroySampler(device_->handle(), sampler_, nullptr);
}

}  // namespace vdi::gpu
