// A compute shader ready to be dispatched. Buffers reach shaders as device addresses in the push constants,
// or in the uniforms if there are too many parameters. So the only descriptors are the uniforms and the
// sampled images, in one set that is written when they change.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <memory>
#include <span>

#include "vdi/gpu/CompiledPipeline.h"
#include "vdi/gpu/Memory.h"

namespace vdi::gpu {

class Device;

/// Pipelines of equal info share compiled code if the shader is the library's; each has its own images and
/// uniforms.
class ComputePipeline {
 public:
  ComputePipeline(std::shared_ptr<Device> device, const ComputePipelineInfo& info);
  ~ComputePipeline();
  ComputePipeline(const ComputePipeline&) = delete;
  ComputePipeline& operator=(const ComputePipeline&) = delete;
  ComputePipeline(ComputePipeline&&) = delete;
  ComputePipeline& operator=(ComputePipeline&&) = delete;

  /// Writes the descriptor set: exactly imageCount images. Must not be called while a dispatch of this
  /// pipeline is in flight. A shader that also stores to images samples these in the layout of its stores
  /// (Commands::beginStores).
  void bindImages(std::span<const SampledImage* const> images, const Sampler& sampler);
  /// Writes the descriptors of the images to which the shader stores, exactly storeCount, under the same
  /// condition.
  void bindStores(std::span<const SampledImage* const> images);
  /// Writes the descriptor of the one 2-D image, under the same condition.
  void bindPlane(const SampledImage& image, const Sampler& sampler);
  /// Writes the descriptor of the uniforms, a buffer of uniformBytes, under the same condition.
  void bindUniforms(const Buffer& buffer);

  VkPipeline handle() const { return compiled_->handle(); }
  VkPipelineLayout layout() const { return compiled_->layout(); }
  VkDescriptorSet descriptorSet() const { return set_; }  // VK_NULL_HANDLE without descriptors

 private:
  void makeDescriptorSet(const ComputePipelineInfo& info);
  void bind(std::uint32_t binding, std::span<const SampledImage* const> images, const Sampler& sampler,
            VkImageLayout layout);
  void write(std::uint32_t binding, VkDescriptorType type, std::span<const VkDescriptorImageInfo> infos);
  void release() noexcept;

  std::shared_ptr<Device> device_;
  std::shared_ptr<const CompiledPipeline> compiled_;
  std::uint32_t imageCount_ = 0;
  std::uint32_t storeCount_ = 0;
  std::uint32_t uniformBytes_ = 0;
  bool hasPlane_ = false;
  VkDescriptorPool pool_ = VK_NULL_HANDLE;
  VkDescriptorSet set_ = VK_NULL_HANDLE;
};

}  // namespace vdi::gpu
