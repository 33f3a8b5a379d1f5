#include "vdi/gpu/CompiledPipeline.h"

#include <utility>

#include "vdi/gpu/VulkanResult.h"

namespace vdi::gpu {

namespace {

/// A module that exists only while its pipeline is made.
class ShaderModule {
 public:
  ShaderModule(VkDevice device, std::span<const std::uint32_t> code) : device_(device) {
    const VkShaderModuleCreateInfo info{VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO, nullptr, 0,
                                        code.size_bytes(), code.data()};
    check(vkCreateShaderModule(device_, &info, nullptr, &module_), "vkCreateShaderModule");
  }
  ~ShaderModule() { vkDestroyShaderModule(device_, module_, nullptr); }
  ShaderModule(const ShaderModule&) = delete;
  ShaderModule& operator=(const ShaderModule&) = delete;
  VkShaderModule handle() const { return module_; }

 private:
  VkDevice device_;
  VkShaderModule module_ = VK_NULL_HANDLE;
};

}  // namespace

std::vector<DescriptorBinding> descriptorBindings(const ComputePipelineInfo& info) {
  std::vector<DescriptorBinding> bindings;
  if (info.imageCount > 0)
    bindings.push_back({descriptorImages, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, info.imageCount});
  if (info.hasPlane) bindings.push_back({descriptorPlane, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 1});
  if (info.storeCount > 0)
    bindings.push_back({descriptorStores, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, info.storeCount});
  if (info.uniformBytes > 0) bindings.push_back({descriptorUniforms, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, 1});
  return bindings;
}

CompiledPipeline::CompiledPipeline(const PipelineTarget& target, const ComputePipelineInfo& info)
    : device_(target.device) {
  try {
    makeSetLayout(info);
    makePipeline(target, info);
  } catch (...) {
    release();
    throw;
  }
}

CompiledPipeline::~CompiledPipeline() {
  release();
}

void CompiledPipeline::makeSetLayout(const ComputePipelineInfo& info) {
  std::vector<VkDescriptorSetLayoutBinding> bindings;
  for (const DescriptorBinding& binding : descriptorBindings(info))
    bindings.push_back({binding.binding, binding.type, binding.count, VK_SHADER_STAGE_COMPUTE_BIT, nullptr});
  if (bindings.empty()) return;
  const VkDescriptorSetLayoutCreateInfo layoutInfo{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
                                                   nullptr, 0, static_cast<std::uint32_t>(bindings.size()),
                                                   bindings.data()};
  check(vkCreateDescriptorSetLayout(device_, &layoutInfo, nullptr, &setLayout_),
        "vkCreateDescriptorSetLayout");
}

void CompiledPipeline::makePipeline(const PipelineTarget& target, const ComputePipelineInfo& info) {
  const VkPushConstantRange range{VK_SHADER_STAGE_COMPUTE_BIT, 0, info.pushConstantBytes};
  const VkPipelineLayoutCreateInfo layoutInfo{VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO,
                                              nullptr,
                                              0,
                                              setLayout_ != VK_NULL_HANDLE ? 1U : 0U,
                                              &setLayout_,
                                              info.pushConstantBytes > 0 ? 1U : 0U,
                                              &range};
  check(vkCreatePipelineLayout(device_, &layoutInfo, nullptr, &layout_), "vkCreatePipelineLayout");
  std::vector<VkSpecializationMapEntry> entries;
  for (std::uint32_t id = 0; id < info.specialization.size(); ++id) {
    entries.push_back({id, id * static_cast<std::uint32_t>(sizeof(std::uint32_t)), sizeof(std::uint32_t)});
  }
  const VkSpecializationInfo specialization{static_cast<std::uint32_t>(entries.size()), entries.data(),
                                            info.specialization.size() * sizeof(std::uint32_t),
                                            info.specialization.data()};
  const ShaderModule module(device_, info.code.empty() ? shaderCode(info.shader) : info.code);
  const VkPipelineShaderStageRequiredSubgroupSizeCreateInfo subgroups{
      VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_REQUIRED_SUBGROUP_SIZE_CREATE_INFO, nullptr,
      target.subgroupSize};
  const VkPipelineShaderStageCreateFlags whole = VK_PIPELINE_SHADER_STAGE_CREATE_REQUIRE_FULL_SUBGROUPS_BIT;
  const VkComputePipelineCreateInfo pipelineInfo{
      VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO,
      nullptr,
      0,
      {VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO, info.wholeSubgroups ? &subgroups : nullptr,
       info.wholeSubgroups ? whole : 0, VK_SHADER_STAGE_COMPUTE_BIT, module.handle(), "main",
       &specialization},
      layout_,
      VK_NULL_HANDLE,
      -1};
  check(vkCreateComputePipelines(device_, target.cache, 1, &pipelineInfo, nullptr, &pipeline_),
        "vkCreateComputePipelines");
}

void CompiledPipeline::release() noexcept {
  if (pipeline_ != VK_NULL_HANDLE) vkDestroyPipeline(device_, pipeline_, nullptr);
  if (layout_ != VK_NULL_HANDLE) vkDestroyPipelineLayout(device_, layout_, nullptr);
  if (setLayout_ != VK_NULL_HANDLE) vkDestroyDescriptorSetLayout(device_, setLayout_, nullptr);
}

std::shared_ptr<const CompiledPipeline> CompiledPipelines::of(const PipelineTarget& target,
                                                              const ComputePipelineInfo& info,
                                                              const Made& made) {
  Key key{std::string(info.shader), info.pushConstantBytes, info.imageCount,     info.storeCount,
          info.uniformBytes > 0,    info.hasPlane,          info.wholeSubgroups, info.specialization};
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = pipelines_.find(key); found != pipelines_.end()) return found->second;
  }
  // Compiles without the lock, because another thread may need a pipeline that exists. If two threads compile
  // the same one, the first to finish wins.
  auto compiled = std::make_shared<const CompiledPipeline>(target, info);
  made(*compiled);
  const std::lock_guard lock(mutex_);
  return pipelines_.try_emplace(std::move(key), std::move(compiled)).first->second;
}

}  // namespace vdi::gpu
