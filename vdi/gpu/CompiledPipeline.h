// Compiled compute shaders, which a device has once for all who run them: to compile one takes longer than
// most frames.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <tuple>
#include <vector>

namespace vdi::gpu {

class Device;
struct ComputePipelineInfo;

/// A pipeline, and how its parameters are laid out. Holds nothing that a user of it changes.
class CompiledPipeline {
 public:
  /// `device` must live longer. Throws Error if it can't be made.
  CompiledPipeline(const Device& device, const ComputePipelineInfo& info);
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
  void makePipeline(const Device& device, const ComputePipelineInfo& info);
  void release() noexcept;

  VkDevice device_;
  VkDescriptorSetLayout setLayout_ = VK_NULL_HANDLE;
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
  VkPipeline pipeline_ = VK_NULL_HANDLE;
};

/// Those of the shaders of this library. From any thread.
class CompiledPipelines {
 public:
  /// Compiled when it's first asked for. `device`: the same in all calls.
  std::shared_ptr<const CompiledPipeline> of(const Device& device, const ComputePipelineInfo& info);
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
