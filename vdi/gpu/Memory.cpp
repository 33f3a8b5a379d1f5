#include "vdi/gpu/Memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>

#include "vdi/core/Error.h"
#include "vdi/gpu/Device.h"
#include "vdi/gpu/VulkanDevice.h"
#include "vdi/gpu/VulkanResult.h"

namespace vdi::gpu {

namespace {

constexpr std::uint64_t smallestBuffer = 16;

double mebibytes(std::uint64_t bytes) {
  return static_cast<double>(bytes) / (1 << 20);
}

/// Names the figures that a user needs to make the problem fit.
[[noreturn]] void throwOutOfMemory(const Device& device, std::uint64_t bytes, const char* what) {
  const DeviceLimits& limits = device.limits();
  throw Error(
      ErrorCode::OutOfMemory,
      fmt::format(
          "not enough memory for a {} of {:.1f} MiB: this process holds {:.1f} MiB of the {} {:.0f} MiB, and "
          "one allocation can have at most {:.0f} MiB",
          what, mebibytes(bytes), mebibytes(device.allocatedBytes()),
          limits.mostBytes > 0 ? "allowed" : "device's", mebibytes(limits.memoryBytes),
          mebibytes(limits.maxAllocationBytes)),
      device.name());
}

void requireRoom(VkResult result, const char* call, const Device& device, std::uint64_t bytes,
                 const char* what) {
  if (result == VK_ERROR_OUT_OF_DEVICE_MEMORY || result == VK_ERROR_OUT_OF_HOST_MEMORY)
    throwOutOfMemory(device, bytes, what);
  check(result, call);
}

VkDeviceMemory allocate(Device& device, const VkMemoryRequirements& needs, std::uint32_t type,
                        const void* chain, const char* what) {
  const std::uint64_t most = device.limits().mostBytes;
  if (most > 0 && device.allocatedBytes() + needs.size > most) throwOutOfMemory(device, needs.size, what);
  const VkMemoryAllocateInfo info{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, chain, needs.size, type};
  VkDeviceMemory memory = VK_NULL_HANDLE;
  requireRoom(vkAllocateMemory(device.vulkan().handle(), &info, nullptr, &memory), "vkAllocateMemory", device,
              needs.size, what);
  device.vulkan().accountAllocation(static_cast<std::int64_t>(needs.size));
  return memory;
}

/// Queue families that may use a buffer or an image.
class QueueFamilies {
 public:
  explicit QueueFamilies(const Device& device)
      : families_{device.vulkan().queueFamily(QueueKind::Compute),
                  device.vulkan().queueFamily(QueueKind::Transfer)} {}
  VkSharingMode mode() const { return several() ? VK_SHARING_MODE_CONCURRENT : VK_SHARING_MODE_EXCLUSIVE; }
  std::uint32_t count() const { return several() ? 2 : 0; }
  const std::uint32_t* data() const { return families_.data(); }

 private:
  bool several() const { return families_[0] != families_[1]; }
  std::array<std::uint32_t, 2> families_;
};

const char* kindName(MemoryKind kind) {
  switch (kind) {
    case MemoryKind::DeviceLocal:
      return "device-local";
    case MemoryKind::Upload:
      return "upload";
    case MemoryKind::Readback:
      return "readback";
  }
  return "unknown";
}

std::uint32_t memoryTypeFor(const Device& device, std::uint32_t typeBits, MemoryKind kind) {
  constexpr VkMemoryPropertyFlags host =
      VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  if (kind == MemoryKind::DeviceLocal)
    return device.vulkan().memoryType(typeBits, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
  if (kind == MemoryKind::Readback) {
    const auto cached = device.vulkan().findMemoryType(typeBits, host | VK_MEMORY_PROPERTY_HOST_CACHED_BIT);
    if (cached) return *cached;
  }
  return device.vulkan().memoryType(typeBits, host);
}

}  // namespace

std::uint64_t texelBytes(VkFormat format) {
  switch (format) {
    case VK_FORMAT_R8_UNORM:
      return 1;
    case VK_FORMAT_R16_UNORM:
      return 2;
    case VK_FORMAT_R32_SFLOAT:
      return 4;
    case VK_FORMAT_R16G16B16A16_SFLOAT:
      return 8;
    default:
      assert(false && "not a format of images");
      return 4;
  }
}

Buffer::Buffer(std::shared_ptr<Device> device, std::uint64_t bytes, MemoryKind kind)
    : device_(std::move(device)), size_(std::max(bytes, smallestBuffer)) {
  // vkCmdFillBuffer fills whole words only.
  const std::uint64_t words = (size_ + 3) / 4 * 4;
  const DeviceLimits& limits = device_->limits();
  if (words > limits.maxAllocationBytes || words > limits.maxBufferBytes)
    throwOutOfMemory(*device_, words, "buffer");
  const QueueFamilies families(*device_);
  try {
    const VkBufferCreateInfo info{VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO,
                                  nullptr,
                                  0,
                                  words,
                                  VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT |
                                      VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT |
                                      VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT |
                                      VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT,
                                  families.mode(),
                                  families.count(),
                                  families.data()};
    requireRoom(vkCreateBuffer(device_->vulkan().handle(), &info, nullptr, &buffer_), "vkCreateBuffer",
                *device_, words, "buffer");
    VkMemoryRequirements needs;
    vkGetBufferMemoryRequirements(device_->vulkan().handle(), buffer_, &needs);
    const VkMemoryAllocateFlagsInfo flags{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO, nullptr,
                                          VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT, 0};
    memory_ =
        allocate(*device_, needs, memoryTypeFor(*device_, needs.memoryTypeBits, kind), &flags, "buffer");
    allocated_ = needs.size;
    requireRoom(vkBindBufferMemory(device_->vulkan().handle(), buffer_, memory_, 0), "vkBindBufferMemory",
                *device_, words, "buffer");
    const VkBufferDeviceAddressInfo addressInfo{VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO, nullptr,
                                                buffer_};
    address_ = vkGetBufferDeviceAddress(device_->vulkan().handle(), &addressInfo);
    device_->vulkan().setName(VK_OBJECT_TYPE_BUFFER, buffer_,
                              fmt::format("{} buffer of {} bytes", kindName(kind), size_));
    if (kind != MemoryKind::DeviceLocal) {
      void* data = nullptr;
      check(vkMapMemory(device_->vulkan().handle(), memory_, 0, VK_WHOLE_SIZE, 0, &data), "vkMapMemory");
      mapped_ = {static_cast<std::byte*>(data), size_};
    }
  } catch (...) {
    release();
    throw;
  }
}

std::optional<ImportedBuffer> importHostMemory(const std::shared_ptr<Device>& device, const void* data,
                                               std::uint64_t bytes) {
  const std::uint64_t alignment = device->limits().hostPointerAlignment;
  if (alignment == 0) return std::nullopt;
  const auto address = reinterpret_cast<std::uintptr_t>(data);
  const std::uintptr_t base = address / alignment * alignment;
  const std::uint64_t size = (address + bytes - base + alignment - 1) / alignment * alignment;
  if (size > device->limits().maxBufferBytes) return std::nullopt;
  void* pages = reinterpret_cast<void*>(base);  // NOLINT(performance-no-int-to-ptr): aligning a pointer
  constexpr auto handleType = VK_EXTERNAL_MEMORY_HANDLE_TYPE_HOST_ALLOCATION_BIT_EXT;

  ImportedBuffer result;
  result.offset = address - base;
  Buffer& buffer = result.buffer;
  buffer.device_ = device;
  buffer.size_ = size;
  const VkExternalMemoryBufferCreateInfo external{VK_STRUCTURE_TYPE_EXTERNAL_MEMORY_BUFFER_CREATE_INFO,
                                                  nullptr, handleType};
  const QueueFamilies families(*device);
  const VkBufferCreateInfo bufferInfo{VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO,
                                      &external,
                                      0,
                                      size,
                                      VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                                      families.mode(),
                                      families.count(),
                                      families.data()};
  if (vkCreateBuffer(device->vulkan().handle(), &bufferInfo, nullptr, &buffer.buffer_) != VK_SUCCESS) {
    buffer.buffer_ = VK_NULL_HANDLE;
    return std::nullopt;
  }
  VkMemoryRequirements needs;
  vkGetBufferMemoryRequirements(device->vulkan().handle(), buffer.buffer_, &needs);
  const std::optional<std::uint32_t> type = device->vulkan().findMemoryType(
      needs.memoryTypeBits & device->vulkan().memoryTypesOfHostPointer(pages), 0);
  if (!type || needs.size > size) return std::nullopt;
  const VkImportMemoryHostPointerInfoEXT import{VK_STRUCTURE_TYPE_IMPORT_MEMORY_HOST_POINTER_INFO_EXT,
                                                nullptr, handleType, pages};
  const VkMemoryAllocateInfo memoryInfo{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, &import, size, *type};
  if (vkAllocateMemory(device->vulkan().handle(), &memoryInfo, nullptr, &buffer.memory_) != VK_SUCCESS) {
    buffer.memory_ = VK_NULL_HANDLE;
    return std::nullopt;
  }
  if (vkBindBufferMemory(device->vulkan().handle(), buffer.buffer_, buffer.memory_, 0) != VK_SUCCESS)
    return std::nullopt;
  return result;
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
  assert(buffer_ == VK_NULL_HANDLE || (kind == MemoryKind::DeviceLocal) == mapped_.empty());
  if (buffer_ != VK_NULL_HANDLE && size_ >= bytes) return false;
  const bool grows = buffer_ != VK_NULL_HANDLE;
  const std::uint64_t maximum =
      std::min(device->limits().maxAllocationBytes, device->limits().maxBufferBytes);
  release();  // releases first, so that both need not fit at once
  if (grows && bytes < maximum) {
    try {
      *this = Buffer(device, std::min(bytes + bytes / 2, maximum), kind);
      return true;
    } catch (const Error& error) {
      if (error.code() != ErrorCode::OutOfMemory) throw;
    }
  }
  *this = Buffer(device, bytes, kind);
  return true;
}

void Buffer::release() noexcept {
  if (!device_) return;
  if (buffer_ != VK_NULL_HANDLE) vkDestroyBuffer(device_->vulkan().handle(), buffer_, nullptr);
  if (memory_ != VK_NULL_HANDLE) vkFreeMemory(device_->vulkan().handle(), memory_, nullptr);
  device_->vulkan().accountAllocation(-static_cast<std::int64_t>(allocated_));
  buffer_ = VK_NULL_HANDLE;
  memory_ = VK_NULL_HANDLE;
  size_ = 0;
  allocated_ = 0;
  address_ = 0;
  mapped_ = {};
  device_.reset();
}

SampledImage::SampledImage(std::shared_ptr<Device> device, const glm::uvec3& extent, VkFormat format)
    : SampledImage(std::move(device), extent, format, VK_IMAGE_TYPE_3D, VK_IMAGE_VIEW_TYPE_3D) {}

SampledImage SampledImage::plane(std::shared_ptr<Device> device, const glm::uvec2& extent, VkFormat format) {
  return {std::move(device), {extent, 1}, format, VK_IMAGE_TYPE_2D, VK_IMAGE_VIEW_TYPE_2D};
}

SampledImage::SampledImage(std::shared_ptr<Device> device, const glm::uvec3& extent, VkFormat format,
                           VkImageType type, VkImageViewType viewType)
    : device_(std::move(device)), extent_(extent), format_(format) {
  assert(glm::all(glm::greaterThan(extent, glm::uvec3(0))));
  const std::uint32_t longest = device_->limits().maxImageDimension3D;
  if (type == VK_IMAGE_TYPE_3D && glm::any(glm::greaterThan(extent, glm::uvec3(longest)))) {
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("a texture of {} x {} x {} is beyond the device's {} per axis", extent.x,
                            extent.y, extent.z, longest),
                device_->name());
  }
  // Drivers overflow when they compute sizes beyond their limits, so this check comes first.
  const std::uint64_t bytes = std::uint64_t{extent.x} * extent.y * extent.z * texelBytes(format);
  if (bytes > device_->limits().maxAllocationBytes) throwOutOfMemory(*device_, bytes, "texture");
  const QueueFamilies families(*device_);
  const bool stores = type == VK_IMAGE_TYPE_3D && device_->limits().storesTexels;
  const VkImageUsageFlags usage = VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT |
                                  (stores ? VkImageUsageFlags{VK_IMAGE_USAGE_STORAGE_BIT} : 0U);
  try {
    const VkImageCreateInfo info{VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO,
                                 nullptr,
                                 0,
                                 type,
                                 format,
                                 {extent.x, extent.y, extent.z},
                                 1,
                                 1,
                                 VK_SAMPLE_COUNT_1_BIT,
                                 VK_IMAGE_TILING_OPTIMAL,
                                 usage,
                                 families.mode(),
                                 families.count(),
                                 families.data(),
                                 VK_IMAGE_LAYOUT_UNDEFINED};
    requireRoom(vkCreateImage(device_->vulkan().handle(), &info, nullptr, &image_), "vkCreateImage", *device_,
                bytes, "texture");
    VkMemoryRequirements needs;
    vkGetImageMemoryRequirements(device_->vulkan().handle(), image_, &needs);
    memory_ =
        allocate(*device_, needs, memoryTypeFor(*device_, needs.memoryTypeBits, MemoryKind::DeviceLocal),
                 nullptr, "texture");
    allocated_ = needs.size;
    requireRoom(vkBindImageMemory(device_->vulkan().handle(), image_, memory_, 0), "vkBindImageMemory",
                *device_, bytes, "texture");
    const VkImageViewCreateInfo viewInfo{
        VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO, nullptr, 0, image_, viewType, format, {},
        {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1}};
    check(vkCreateImageView(device_->vulkan().handle(), &viewInfo, nullptr, &view_), "vkCreateImageView");
    device_->vulkan().setName(VK_OBJECT_TYPE_IMAGE, image_,
                              fmt::format("texture of {} x {} x {}", extent.x, extent.y, extent.z));
  } catch (...) {
    release();
    throw;
  }
}

SampledImage::~SampledImage() {
  release();
}

SampledImage::SampledImage(SampledImage&& other) noexcept {
  *this = std::move(other);
}

SampledImage& SampledImage::operator=(SampledImage&& other) noexcept {
  if (this == &other) return *this;
  release();
  device_ = std::move(other.device_);
  image_ = std::exchange(other.image_, VK_NULL_HANDLE);
  view_ = std::exchange(other.view_, VK_NULL_HANDLE);
  memory_ = std::exchange(other.memory_, VK_NULL_HANDLE);
  allocated_ = std::exchange(other.allocated_, 0);
  extent_ = std::exchange(other.extent_, glm::uvec3(0));
  format_ = std::exchange(other.format_, VK_FORMAT_UNDEFINED);
  return *this;
}

void SampledImage::release() noexcept {
  if (!device_) return;
  if (view_ != VK_NULL_HANDLE) vkDestroyImageView(device_->vulkan().handle(), view_, nullptr);
  if (image_ != VK_NULL_HANDLE) vkDestroyImage(device_->vulkan().handle(), image_, nullptr);
  if (memory_ != VK_NULL_HANDLE) vkFreeMemory(device_->vulkan().handle(), memory_, nullptr);
  device_->vulkan().accountAllocation(-static_cast<std::int64_t>(allocated_));
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
  check(vkCreateSampler(device_->vulkan().handle(), &info, nullptr, &sampler_), "vkCreateSampler");
}

Sampler::~Sampler() {
  vkDestroySampler(device_->vulkan().handle(), sampler_, nullptr);
}

}  // namespace vdi::gpu
