// A compute shader ready to be dispatched. Buffers reach shaders as device addresses, inside the push
// constants or inside the uniforms, if it has more parameters than fit there; so the only descriptors are the
// uniforms and the sampled 3-D images, in one set that is written when they change.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <memory>
#include <span>

#include "vdi/gpu/CompiledPipeline.h"
#include "vdi/gpu/Memory.h"

namespace vdi::gpu {

class Device;

/// Those of equal info share what's compiled, if that's a shader of the library; images and uniforms are each
/// one's own.
class ComputePipeline {
 public:
  ComputePipeline(std::shared_ptr<Device> device, const ComputePipelineInfo& info);
  ~ComputePipeline();
  ComputePipeline(const ComputePipeline&) = delete;
  ComputePipeline& operator=(const ComputePipeline&) = delete;
  ComputePipeline(ComputePipeline&&) = delete;
  ComputePipeline& operator=(ComputePipeline&&) = delete;

  /// Writes the descriptor set: exactly imageCount images. Must not be called while a dispatch of this
  /// pipeline is in flight.
  void bindImages(std::span<const SampledImage* const> images, const Sampler& sampler);
  /// Likewise, of the one 2-D image.
  void bindPlane(const SampledImage& image, const Sampler& sampler);
  /// Likewise, a buffer of uniformBytes.
  void bindUniforms(const Buffer& buffer);

  VkPipeline handle() const { return compiled_->handle(); }
  VkPipelineLayout layout() const { return compiled_->layout(); }
  VkDescriptorSet descriptorSet() const { return set_; }  // VK_NULL_HANDLE without any

 private:
  void makeDescriptorSet(const ComputePipelineInfo& info);
  void bind(std::uint32_t binding, std::span<const SampledImage* const> images, const Sampler& sampler);
  void release() noexcept;

  std::shared_ptr<Device> device_;
  std::shared_ptr<const CompiledPipeline> compiled_;
  std::uint32_t imageCount_ = 0;
  std::uint32_t uniformBytes_ = 0;
  bool hasPlane_ = false;
  VkDescriptorPool pool_ = VK_NULL_HANDLE;
  VkDescriptorSet set_ = VK_NULL_HANDLE;
};

}  // namespace vdi::gpu
