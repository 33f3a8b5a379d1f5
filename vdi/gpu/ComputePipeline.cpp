#include "vdi/gpu/ComputePipeline.h"

#include <cassert>
#include <string>
#include <utility>

#include "vdi/gpu/Device.h"
#include "vdi/gpu/VulkanDevice.h"
#include "vdi/gpu/VulkanResult.h"

namespace vdi::gpu {

namespace {

constexpr std::uint32_t guaranteedPushConstantBytes = 128;
constexpr std::uint32_t imageBinding = 0;
constexpr std::uint32_t uniformBinding = 1;
constexpr std::uint32_t planeBinding = 2;

/// Exists just while the pipeline is made.
class ShaderModule {
 public:
  ShaderModule(const Device& device, std::span<const std::uint32_t> code)
      : device_(device.vulkan().handle()) {
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

ComputePipeline::ComputePipeline(std::shared_ptr<Device> device, const ComputePipelineInfo& info)
    : device_(std::move(device)),
      imageCount_(info.imageCount),
      uniformBytes_(info.uniformBytes),
      hasPlane_(info.hasPlane) {
  assert(info.pushConstantBytes <= guaranteedPushConstantBytes);
  try {
    if (imageCount_ > 0 || uniformBytes_ > 0 || hasPlane_) makeDescriptorSet();
    makePipeline(info);
  } catch (...) {
    release();
    throw;
  }
}

ComputePipeline::~ComputePipeline() {
  release();
}

void ComputePipeline::makeDescriptorSet() {
  std::vector<VkDescriptorSetLayoutBinding> bindings;
  std::vector<VkDescriptorPoolSize> sizes;
  const auto add = [&](std::uint32_t binding, VkDescriptorType type, std::uint32_t count) {
    if (count == 0) return;
    bindings.push_back({binding, type, count, VK_SHADER_STAGE_COMPUTE_BIT, nullptr});
    sizes.push_back({type, count});
  };
  add(imageBinding, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, imageCount_);
  add(planeBinding, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, hasPlane_ ? 1 : 0);
  add(uniformBinding, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, uniformBytes_ > 0 ? 1 : 0);
  const VkDescriptorSetLayoutCreateInfo layoutInfo{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
                                                   nullptr, 0, static_cast<std::uint32_t>(bindings.size()),
                                                   bindings.data()};
  check(vkCreateDescriptorSetLayout(device_->vulkan().handle(), &layoutInfo, nullptr, &setLayout_),
        "vkCreateDescriptorSetLayout");
  const VkDescriptorPoolCreateInfo poolInfo{VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO, nullptr,     0, 1,
                                            static_cast<std::uint32_t>(sizes.size()),      sizes.data()};
  check(vkCreateDescriptorPool(device_->vulkan().handle(), &poolInfo, nullptr, &pool_),
        "vkCreateDescriptorPool");
  const VkDescriptorSetAllocateInfo setInfo{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO, nullptr, pool_, 1,
                                            &setLayout_};
  check(vkAllocateDescriptorSets(device_->vulkan().handle(), &setInfo, &set_), "vkAllocateDescriptorSets");
}

void ComputePipeline::makePipeline(const ComputePipelineInfo& info) {
  const VkPushConstantRange range{VK_SHADER_STAGE_COMPUTE_BIT, 0, info.pushConstantBytes};
  const VkPipelineLayoutCreateInfo layoutInfo{VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO,
                                              nullptr,
                                              0,
                                              set_ != VK_NULL_HANDLE ? 1U : 0U,
                                              &setLayout_,
                                              info.pushConstantBytes > 0 ? 1U : 0U,
                                              &range};
  check(vkCreatePipelineLayout(device_->vulkan().handle(), &layoutInfo, nullptr, &layout_),
        "vkCreatePipelineLayout");
  std::vector<VkSpecializationMapEntry> entries;
  for (std::uint32_t id = 0; id < info.specialization.size(); ++id) {
    entries.push_back({id, id * static_cast<std::uint32_t>(sizeof(std::uint32_t)), sizeof(std::uint32_t)});
  }
  const VkSpecializationInfo specialization{static_cast<std::uint32_t>(entries.size()), entries.data(),
                                            info.specialization.size() * sizeof(std::uint32_t),
                                            info.specialization.data()};
  const ShaderModule module(*device_, info.code.empty() ? shaderCode(info.shader) : info.code);
  const VkPipelineShaderStageRequiredSubgroupSizeCreateInfo subgroups{
      VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_REQUIRED_SUBGROUP_SIZE_CREATE_INFO, nullptr,
      device_->limits().subgroupSize};
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
  check(vkCreateComputePipelines(device_->vulkan().handle(), device_->vulkan().pipelineCache(), 1,
                                 &pipelineInfo, nullptr, &pipeline_),
        "vkCreateComputePipelines");
  const std::string name(info.code.empty() ? info.shader : "a shader without a name");
  device_->vulkan().setName(VK_OBJECT_TYPE_PIPELINE, pipeline_, name);
  device_->vulkan().setName(VK_OBJECT_TYPE_PIPELINE_LAYOUT, layout_, "layout of " + name);
  if (set_ != VK_NULL_HANDLE)
    device_->vulkan().setName(VK_OBJECT_TYPE_DESCRIPTOR_SET, set_, "descriptors of " + name);
}

void ComputePipeline::bindImages(std::span<const SampledImage* const> images, const Sampler& sampler) {
  assert(images.size() == imageCount_);
  bind(imageBinding, images, sampler);
}

void ComputePipeline::bindPlane(const SampledImage& image, const Sampler& sampler) {
  assert(hasPlane_);
  const SampledImage* const images[] = {&image};
  bind(planeBinding, images, sampler);
}

void ComputePipeline::bind(std::uint32_t binding, std::span<const SampledImage* const> images,
                           const Sampler& sampler) {
  std::vector<VkDescriptorImageInfo> infos;
  for (const SampledImage* image : images)
    infos.push_back({sampler.handle(), image->view(), VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL});
  const VkWriteDescriptorSet write{VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
                                   nullptr,
                                   set_,
                                   binding,
                                   0,
                                   static_cast<std::uint32_t>(infos.size()),
                                   VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER,
                                   infos.data(),
                                   nullptr,
                                   nullptr};
  vkUpdateDescriptorSets(device_->vulkan().handle(), 1, &write, 0, nullptr);
}

void ComputePipeline::bindUniforms(const Buffer& buffer) {
  const VkDescriptorBufferInfo info{buffer.handle(), 0, uniformBytes_};
  const VkWriteDescriptorSet write{
      VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET, nullptr, set_,  uniformBinding, 0, 1,
      VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER,      nullptr, &info, nullptr};
  vkUpdateDescriptorSets(device_->vulkan().handle(), 1, &write, 0, nullptr);
}

void ComputePipeline::release() noexcept {
  VkDevice device = device_->vulkan().handle();
  if (pipeline_ != VK_NULL_HANDLE) vkDestroyPipeline(device, pipeline_, nullptr);
  if (layout_ != VK_NULL_HANDLE) vkDestroyPipelineLayout(device, layout_, nullptr);
  if (pool_ != VK_NULL_HANDLE) vkDestroyDescriptorPool(device, pool_, nullptr);
  if (setLayout_ != VK_NULL_HANDLE) vkDestroyDescriptorSetLayout(device, setLayout_, nullptr);
}

}  // namespace vdi::gpu
