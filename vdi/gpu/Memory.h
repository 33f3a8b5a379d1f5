// Buffers and images: RAII, with one VkDeviceMemory each (the library makes few and large ones).
#pragma once

#include <vulkan/vulkan.h>

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>

namespace vdi::gpu {

class Device;

enum class MemoryKind {
  DeviceLocal,  // storage and transfer, not mapped
  Upload,       // host-visible and coherent, written by the host in order
  Readback,     // host-visible and coherent, cached if there is such a type
};

/// Bytes of a texel of the formats that SampledImage supports: R8_UNORM, R16_UNORM, R32_SFLOAT,
/// R16G16B16A16_SFLOAT. Asserts one of them.
std::uint64_t texelBytes(VkFormat format);

/// A buffer with a device address. Usage: storage, uniforms, transfer source and destination.
class Buffer {
 public:
  Buffer() = default;
  /// Smaller sizes are rounded up to 16 bytes. Throws Error{OutOfMemory} with the MiB requested, the MiB that
  /// this Device's Buffers and Images hold, and the device's memory.
  Buffer(std::shared_ptr<Device> device, std::uint64_t bytes, MemoryKind kind);
  ~Buffer();
  Buffer(Buffer&& other) noexcept;
  Buffer& operator=(Buffer&& other) noexcept;
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  explicit operator bool() const { return buffer_ != VK_NULL_HANDLE; }
  VkBuffer handle() const { return buffer_; }
  std::uint64_t size() const { return size_; }
  VkDeviceAddress address() const { return address_; }
  /// Mapped memory of Upload and Readback buffers, `size()` bytes; empty for DeviceLocal.
  std::span<std::byte> mapped() const { return mapped_; }
  template <typename T>
  std::span<T> mappedAs() const {
    return {reinterpret_cast<T*>(mapped_.data()), mapped_.size() / sizeof(T)};
  }

  /// Makes the buffer hold at least `bytes`: keeps it if it is large enough, else replaces it and loses the
  /// contents. The first allocation has exactly `bytes`. Later ones have half as much again if the device has
  /// room, so that slow growth does not reallocate every frame. Returns true if the buffer was replaced. If
  /// it throws, the buffer is empty. `kind` must not change.
  bool reserve(const std::shared_ptr<Device>& device, std::uint64_t bytes, MemoryKind kind);

 private:
  friend std::optional<struct ImportedBuffer> importHostMemory(const std::shared_ptr<Device>& device,
                                                               const void* data, std::uint64_t bytes);
  void release() noexcept;
  std::shared_ptr<Device> device_;
  VkBuffer buffer_ = VK_NULL_HANDLE;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
  std::uint64_t size_ = 0;
  std::uint64_t allocated_ = 0;
  VkDeviceAddress address_ = 0;
  std::span<std::byte> mapped_;
};

/// The process's memory as the device sees it: `data` starts `offset` bytes into the buffer, which only
/// serves transfers and covers whole pages.
struct ImportedBuffer {
  Buffer buffer;
  std::uint64_t offset = 0;
};
/// Imports memory without a copy (VK_EXT_external_memory_host); nullopt if the device cannot do that, for any
/// reason. The memory must outlive the buffer.
std::optional<ImportedBuffer> importHostMemory(const std::shared_ptr<Device>& device, const void* data,
                                               std::uint64_t bytes);

/// A 3-D or 2-D image that shaders sample, with its view: one mip level, optimal tiling, for both kinds of
/// queues. Call Commands::clear first, then fill it between Commands::beginUpload and endUpload. Usage:
/// sampled, transfer destination; 3-D images also as DeviceLimits::storesTexels says.
class SampledImage {
 public:
  SampledImage() = default;
  /// Makes a 3-D image. Throws Error{OutOfMemory} as Buffer does, Error{InvalidArgument} for an extent beyond
  /// maxImageDimension3D. No extent may be 0.
  SampledImage(std::shared_ptr<Device> device, const glm::uvec3& extent, VkFormat format);
  /// Makes a 2-D image, whose depth is 1. Throws Error{OutOfMemory}.
  static SampledImage plane(std::shared_ptr<Device> device, const glm::uvec2& extent, VkFormat format);
  ~SampledImage();
  SampledImage(SampledImage&& other) noexcept;
  SampledImage& operator=(SampledImage&& other) noexcept;
  SampledImage(const SampledImage&) = delete;
  SampledImage& operator=(const SampledImage&) = delete;

  explicit operator bool() const { return image_ != VK_NULL_HANDLE; }
  VkImage handle() const { return image_; }
  VkImageView view() const { return view_; }
  const glm::uvec3& extent() const { return extent_; }
  VkFormat format() const { return format_; }

 private:
  SampledImage(std::shared_ptr<Device> device, const glm::uvec3& extent, VkFormat format, VkImageType type,
               VkImageViewType viewType);
  void release() noexcept;
  std::shared_ptr<Device> device_;
  VkImage image_ = VK_NULL_HANDLE;
  VkImageView view_ = VK_NULL_HANDLE;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
  std::uint64_t allocated_ = 0;
  glm::uvec3 extent_{0};
  VkFormat format_ = VK_FORMAT_UNDEFINED;
};

/// Linear, clamp to edge, normalised coordinates.
class Sampler {
 public:
  explicit Sampler(std::shared_ptr<Device> device);
  ~Sampler();
  Sampler(const Sampler&) = delete;
  Sampler& operator=(const Sampler&) = delete;
  Sampler(Sampler&&) = delete;
  Sampler& operator=(Sampler&&) = delete;
  VkSampler handle() const { return sampler_; }

 private:
  std::shared_ptr<Device> device_;
  VkSampler sampler_ = VK_NULL_HANDLE;
};

}  // namespace vdi::gpu
