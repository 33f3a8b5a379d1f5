// A compute shader ready to be dispatched. Buffers reach shaders as device addresses, inside the push
// constants or inside the uniforms, if it has more parameters than fit there; so the only descriptors are the
// uniforms and the sampled 3-D images, in one set that is written when they change.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "vdi/gpu/CompiledPipeline.h"
#include "vdi/gpu/Memory.h"

namespace vdi::gpu {

class Device;

/// SPIR-V of `shaders/<name>.comp`, compiled at build time and embedded in the library; asserts that the name
/// exists.
std::span<const std::uint32_t> shaderCode(std::string_view name);

struct ComputePipelineInfo {
  std::string_view shader;  // name without ".comp", for shaderCode
  std::span<const std::uint32_t>
      code;  // SPIR-V that's used instead when it isn't empty; just while constructing
  std::uint32_t pushConstantBytes = 0;  // at most 128
  std::uint32_t imageCount = 0;         // size of the sampler3D array at set 0, binding 0
  std::uint32_t uniformBytes = 0;       // of the uniform block at set 0, binding 1; 0: none
  bool hasPlane = false;                // a sampler2D at set 0, binding 2
  bool wholeSubgroups = false;          // of DeviceLimits::subgroupSize, of which the workgroup is a multiple
  std::vector<std::uint32_t> specialization;  // constant_id 0, 1, ... as raw 32-bit words
};

/// What's at set 0, binding by binding.
struct DescriptorBinding {
  std::uint32_t binding;
  VkDescriptorType type;
  std::uint32_t count;
};
std::vector<DescriptorBinding> descriptorBindings(const ComputePipelineInfo& info);

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
