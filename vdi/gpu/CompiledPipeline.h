// Compiled compute shaders, which a device has once for all who run them: to compile one takes longer than
// most frames.
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

/// Bindings of set 0.
constexpr std::uint32_t descriptorImages = 0;
constexpr std::uint32_t descriptorUniforms = 1;
constexpr std::uint32_t descriptorPlane = 2;
/// What's there, binding by binding.
struct DescriptorBinding {
  std::uint32_t binding;
  VkDescriptorType type;
  std::uint32_t count;
};
std::vector<DescriptorBinding> descriptorBindings(const ComputePipelineInfo& info);

/// What shaders are compiled for.
struct PipelineTarget {
  VkDevice device = VK_NULL_HANDLE;
  VkPipelineCache cache = VK_NULL_HANDLE;
  std::uint32_t subgroupSize = 0;  // of pipelines with wholeSubgroups
};

/// A pipeline, and how its parameters are laid out. Holds nothing that a user of it changes.
class CompiledPipeline {
 public:
  /// The target's device must live longer. Throws Error if it can't be made.
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

/// Those of the shaders of this library. From any thread.
class CompiledPipelines {
 public:
  using Made = std::function<void(const CompiledPipeline& pipeline)>;
  /// Compiled when it's first asked for; then `made` is called, before anybody else has it. `target`: the
  /// same in all calls.
  std::shared_ptr<const CompiledPipeline> of(const PipelineTarget& target, const ComputePipelineInfo& info,
                                             const Made& made);
  void clear() noexcept { pipelines_.clear(); }

 private:
  /// All of ComputePipelineInfo but the size of uniforms: shader, bytes of push constants, images, whether
  /// there are uniforms, plane, whole subgroups, specialisation.
  using Key =
      std::tuple<std::string, std::uint32_t, std::uint32_t, bool, bool, bool, std::vector<std::uint32_t>>;
  std::mutex mutex_;
  std::map<Key, std::shared_ptr<const CompiledPipeline>> pipelines_;
};

}  // namespace vdi::gpu
