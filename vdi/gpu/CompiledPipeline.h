// Compiled compute shaders, which all users of a device share, because compiling one takes longer than most
// frames.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

namespace vdi::gpu {

/// SPIR-V of `shaders/<name>.comp`, compiled at build time and embedded in the library; asserts that the name
/// exists.
std::span<const std::uint32_t> shaderCode(std::string_view name);

struct ComputePipelineInfo {
  std::string_view shader;  // name for shaderCode
  /// SPIR-V to use instead if it is not empty; needed during construction only.
  std::span<const std::uint32_t> code;
  std::uint32_t pushConstantBytes = 0;        // at most 128
  std::uint32_t imageCount = 0;               // size of the sampler3D array at set 0, binding 0
  std::uint32_t uniformBytes = 0;             // size of the uniform block at set 0, binding 1; 0: none
  std::uint32_t storeCount = 0;               // size of the image3D array at set 0, binding 3
  bool hasPlane = false;                      // whether there is a sampler2D at set 0, binding 2
  bool wholeSubgroups = false;                // full subgroups of subgroupSize, which divides the workgroup
  std::vector<std::uint32_t> specialization;  // constant_id 0, 1, ... as raw 32-bit words
};

/// A shader with these push constants and nothing else.
template <typename Constants>
ComputePipelineInfo infoOf(std::string_view shader) {
  ComputePipelineInfo info;
  info.shader = shader;
  info.pushConstantBytes = sizeof(Constants);
  return info;
}

/// Bindings of set 0.
constexpr std::uint32_t descriptorImages = 0;
constexpr std::uint32_t descriptorUniforms = 1;
constexpr std::uint32_t descriptorPlane = 2;
constexpr std::uint32_t descriptorStores = 3;
/// A binding of the pipeline's descriptor set.
struct DescriptorBinding {
  std::uint32_t binding;
  VkDescriptorType type;
  std::uint32_t count;
};
std::vector<DescriptorBinding> descriptorBindings(const ComputePipelineInfo& info);

/// The device to compile shaders for.
struct PipelineTarget {
  VkDevice device = VK_NULL_HANDLE;
  VkPipelineCache cache = VK_NULL_HANDLE;
  std::uint32_t subgroupSize = 0;  // for pipelines with wholeSubgroups
};

/// A pipeline and its layout. Its users cannot change it.
class CompiledPipeline {
 public:
  /// The target's device must outlive it. Throws Error if the pipeline cannot be made.
  CompiledPipeline(const PipelineTarget& target, const ComputePipelineInfo& info);
  ~CompiledPipeline();
  CompiledPipeline(const CompiledPipeline&) = delete;
  CompiledPipeline& operator=(const CompiledPipeline&) = delete;
  CompiledPipeline(CompiledPipeline&&) = delete;
  CompiledPipeline& operator=(CompiledPipeline&&) = delete;

  VkDescriptorSetLayout setLayout() const { return setLayout_; }  // VK_NULL_HANDLE without descriptors
  VkPipelineLayout layout() const { return layout_; }
  VkPipeline handle() const { return pipeline_; }

 private:
  void makeSetLayout(const ComputePipelineInfo& info);
  void makePipeline(const PipelineTarget& target, const ComputePipelineInfo& info);
  void release() noexcept;

  VkDevice device_;
  VkDescriptorSetLayout setLayout_ = VK_NULL_HANDLE;
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
  VkPipeline pipeline_ = VK_NULL_HANDLE;
};

/// The compiled shaders of this library. Thread-safe.
class CompiledPipelines {
 public:
  using Made = std::function<void(const CompiledPipeline& pipeline)>;
  /// Returns the pipeline, compiled at the first request; then `made` is called before anybody else gets the
  /// pipeline. `target` must be the same in all calls.
  std::shared_ptr<const CompiledPipeline> of(const PipelineTarget& target, const ComputePipelineInfo& info,
                                             const Made& made);
  void clear() noexcept { pipelines_.clear(); }

 private:
  /// All of ComputePipelineInfo except the size of uniforms: shader, bytes of push constants, images, images
  /// to store to, whether there are uniforms, plane, whole subgroups, specialisation.
  using Key = std::tuple<std::string, std::uint32_t, std::uint32_t, std::uint32_t, bool, bool, bool,
                         std::vector<std::uint32_t>>;
  std::mutex mutex_;
  std::map<Key, std::shared_ptr<const CompiledPipeline>> pipelines_;
};

}  // namespace vdi::gpu
