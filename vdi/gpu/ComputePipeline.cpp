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

}  // namespace

ComputePipeline::ComputePipeline(std::shared_ptr<Device> device, const ComputePipelineInfo& info)
    : device_(std::move(device)),
      compiled_(device_->vulkan().compiled(info, device_->limits().subgroupSize)),
      imageCount_(info.imageCount),
      storeCount_(info.storeCount),
      uniformBytes_(info.uniformBytes),
      hasPlane_(info.hasPlane) {
  assert(info.pushConstantBytes <= guaranteedPushConstantBytes);
  try {
    makeDescriptorSet(info);
  } catch (...) {
    release();
    throw;
  }
}

ComputePipeline::~ComputePipeline() {
  release();
}

void ComputePipeline::makeDescriptorSet(const ComputePipelineInfo& info) {
  std::vector<VkDescriptorPoolSize> sizes;
  for (const DescriptorBinding& binding : descriptorBindings(info))
    sizes.push_back({binding.type, binding.count});
  if (sizes.empty()) return;
  const VkDescriptorPoolCreateInfo poolInfo{VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO, nullptr,     0, 1,
                                            static_cast<std::uint32_t>(sizes.size()),      sizes.data()};
  check(vkCreateDescriptorPool(device_->vulkan().handle(), &poolInfo, nullptr, &pool_),
        "vkCreateDescriptorPool");
  const VkDescriptorSetLayout layout = compiled_->setLayout();
  const VkDescriptorSetAllocateInfo setInfo{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO, nullptr, pool_, 1,
                                            &layout};
  check(vkAllocateDescriptorSets(device_->vulkan().handle(), &setInfo, &set_), "vkAllocateDescriptorSets");
  device_->vulkan().setName(VK_OBJECT_TYPE_DESCRIPTOR_SET, set_,
                            "descriptors of " + std::string(info.shader));
}

void ComputePipeline::bindImages(std::span<const SampledImage* const> images, const Sampler& sampler) {
  assert(images.size() == imageCount_);
  bind(descriptorImages, images, sampler,
       storeCount_ > 0 ? VK_IMAGE_LAYOUT_GENERAL : VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL);
}

void ComputePipeline::bindStores(std::span<const SampledImage* const> images) {
  std::vector<VkDescriptorImageInfo> infos;
  for (const SampledImage* image : images)
    infos.push_back({VK_NULL_HANDLE, image->view(), VK_IMAGE_LAYOUT_GENERAL});
  write(descriptorStores, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, infos);
}

void ComputePipeline::bindPlane(const SampledImage& image, const Sampler& sampler) {
  assert(hasPlane_);
  const SampledImage* const images[] = {&image};
  bind(descriptorPlane, images, sampler, VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL);
}

void ComputePipeline::bind(std::uint32_t binding, std::span<const SampledImage* const> images,
                           const Sampler& sampler, VkImageLayout layout) {
  std::vector<VkDescriptorImageInfo> infos;
  for (const SampledImage* image : images) infos.push_back({sampler.handle(), image->view(), layout});
  write(binding, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, infos);
}

void ComputePipeline::write(std::uint32_t binding, VkDescriptorType type,
                            std::span<const VkDescriptorImageInfo> infos) {
  const VkWriteDescriptorSet write{
      VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,   nullptr, set_,         binding, 0,
      static_cast<std::uint32_t>(infos.size()), type,    infos.data(), nullptr, nullptr};
  vkUpdateDescriptorSets(device_->vulkan().handle(), 1, &write, 0, nullptr);
}

void ComputePipeline::bindUniforms(const Buffer& buffer) {
  const VkDescriptorBufferInfo info{buffer.handle(), 0, uniformBytes_};
  const VkWriteDescriptorSet write{VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
                                   nullptr,
                                   set_,
                                   descriptorUniforms,
                                   0,
                                   1,
                                   VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER,
                                   nullptr,
                                   &info,
                                   nullptr};
  vkUpdateDescriptorSets(device_->vulkan().handle(), 1, &write, 0, nullptr);
}

void ComputePipeline::release() noexcept {
  if (pool_ != VK_NULL_HANDLE) vkDestroyDescriptorPool(device_->vulkan().handle(), pool_, nullptr);
}

}  // namespace vdi::gpu
