#include "vdi/gpu/PipelineSet.h"

#include <algorithm>
#include <cassert>
#include <string>
#include <utility>

#include "vdi/gpu/Commands.h"

namespace vdi::gpu {

PipelineSet::PipelineSet(std::shared_ptr<Device> device, ComputePipelineInfo common, bool hasPrograms)
    : device_(std::move(device)), common_(std::move(common)), hasPrograms_(hasPrograms) {
  if (common_.uniformBytes == 0) return;
  uniforms_ = std::make_shared<const Buffer>(device_, common_.uniformBytes, MemoryKind::DeviceLocal);
}

PipelineSet::PipelineSet(const PipelineSet& updated, ComputePipelineInfo common)
    : device_(updated.device_),
      common_(std::move(common)),
      hasPrograms_(updated.hasPrograms_),
      uniforms_(updated.uniforms_) {
  assert(common_.uniformBytes == updated.common_.uniformBytes);
}

void PipelineSet::updateBytes(Commands& commands, std::span<const std::byte> bytes) {
  assert(bytes.size() == common_.uniformBytes);
  // The recorded update may have been dropped.
  const bool wasSubmitted = updatedBy_ == &commands && commands.submissions() > updatedBehind_;
  if (wasSubmitted && std::ranges::equal(bytes, updated_)) return;
  commands.barrier();
  commands.update(*uniforms_, bytes);
  commands.barrier();
  updated_.assign(bytes.begin(), bytes.end());
  updatedBy_ = &commands;
  updatedBehind_ = commands.submissions();
}

template <typename Use>
auto PipelineSet::withInfo(const std::vector<std::uint32_t>& specialization, Use use) const {
  ComputePipelineInfo info = common_;
  info.specialization = specialization;
  std::string program(common_.shader);
  if (hasPrograms_) {
    program.append("_").append(std::to_string(specialization.front()));
    if (!device_->runsGpuPrograms()) program.append("_pruned");
  }
  info.shader = program;
  return use(info);
}

void PipelineSet::compile(const std::vector<std::uint32_t>& specialization) const {
  withInfo(specialization, [this](const ComputePipelineInfo& info) {
    return device_->vulkan().compiled(info, device_->limits().subgroupSize);
  });
}

ComputePipeline& PipelineSet::with(const std::vector<std::uint32_t>& specialization) {
  std::unique_ptr<ComputePipeline>& pipeline = pipelines_[specialization];
  if (!pipeline) {
    pipeline = withInfo(specialization, [this](const ComputePipelineInfo& info) {
      return std::make_unique<ComputePipeline>(device_, info);
    });
    if (uniforms_) pipeline->bindUniforms(*uniforms_);
  }
  return *pipeline;
}

}  // namespace vdi::gpu
