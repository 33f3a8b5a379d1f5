#include "vdi/gpu/ScanPass.h"

#include "shaders/shared/scan.h"
#include "vdi/core/Error.h"
#include "vdi/gpu/Device.h"

namespace vdi::gpu {

namespace {

ComputePipelineInfo pipelineInfo() {
  ComputePipelineInfo info;
  info.shader = "scan";
  info.pushConstantBytes = sizeof(shared::ScanConstants);
  return info;
}

constexpr std::uint32_t perGroup = shared::scanGroup * shared::scanPerThread;

std::uint32_t groupsFor(std::uint32_t count) {
  return (count + perGroup - 1) / perGroup;
}

}  // namespace

ScanPass::ScanPass(std::shared_ptr<Device> device)
    : device_(std::move(device)),
      pipeline_(device_, pipelineInfo()),
      zero_(device_, sizeof(std::uint32_t), MemoryKind::Upload),
      overflow_(device_, sizeof(std::uint32_t), MemoryKind::Readback) {
  zero_.mappedAs<std::uint32_t>()[0] = 0;
}

void ScanPass::record(Commands& commands, const Buffer& values, const Buffer& prefix, std::uint32_t count) {
  // The entry after the last value is scanned along as a 0, which makes its prefix the total.
  commands.copy(zero_, 0, values, std::uint64_t{count} * sizeof(std::uint32_t), sizeof(std::uint32_t));
  commands.copy(zero_, 0, overflow_, 0, sizeof(std::uint32_t));
  commands.barrier();
  struct Level {
    VkDeviceAddress values;
    VkDeviceAddress prefix;
    std::uint32_t count;
  };
  std::vector<Level> levels{{values.address(), prefix.address(), count + 1}};
  for (;;) {
    const Level level = levels.back();
    const std::size_t index = levels.size() - 1;
    const std::uint32_t groups = groupsFor(level.count);
    if (sums_.size() <= index) sums_.emplace_back();
    sums_[index].reserve(device_, std::uint64_t{groups} * sizeof(std::uint32_t), MemoryKind::DeviceLocal);
    commands.dispatch(pipeline_,
                      shared::ScanConstants{level.values, level.prefix, sums_[index].address(),
                                            overflow_.address(), level.count, shared::scanModeSum},
                      groups);
    commands.barrier();
    if (groups == 1) break;
    levels.push_back({sums_[index].address(), sums_[index].address(), groups});
  }
  for (std::size_t i = levels.size() - 1; i-- > 0;) {
    commands.dispatch(pipeline_,
                      shared::ScanConstants{levels[i].values, levels[i].prefix, sums_[i].address(),
                                            overflow_.address(), levels[i].count, shared::scanModeAdd},
                      groupsFor(levels[i].count));
    commands.barrier();
  }
}

void ScanPass::demandNoOverflow() const {
  if (overflow_.mappedAs<std::uint32_t>()[0] != 0) {
    throw Error(ErrorCode::OutOfMemory, "more than 2^32 supersegments in one VDI", device_->name());
  }
}

}  // namespace vdi::gpu
