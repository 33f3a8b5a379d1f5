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

}  // namespace

ScanPass::ScanPass(std::shared_ptr<Device> device)
    : device_(std::move(device)),
      pipeline_(device_, pipelineInfo()),
      overflow_(device_, sizeof(std::uint32_t), MemoryKind::Readback) {}

void ScanPass::record(Commands& commands, const Buffer& values, const Buffer& prefix, std::uint32_t count) {
  overflow_.mappedAs<std::uint32_t>()[0] = 0;
  const std::uint32_t groups = count / perGroup + 1;
  sums_.reserve(device_, std::uint64_t{groups} * sizeof(std::uint32_t), MemoryKind::DeviceLocal);
  shared::ScanConstants constants{};
  constants.values = values.address();
  constants.prefix = prefix.address();
  constants.sums = sums_.address();
  constants.overflow = overflow_.address();
  constants.count = count;
  constants.mode = shared::scanModeSum;
  commands.barrier();
  commands.dispatch(pipeline_, constants, groups);
  commands.barrier();
  constants.mode = shared::scanModeAdd;
  commands.dispatch(pipeline_, constants, groups);
  commands.barrier();
}

void ScanPass::recordRebase(Commands& commands, const Buffer& prefix, std::uint32_t count,
                            std::uint32_t base) const {
  shared::ScanConstants constants{};
  constants.prefix = prefix.address();
  constants.count = count;
  constants.mode = shared::scanModeRebase;
  constants.base = base;
  commands.barrier();
  commands.dispatch(pipeline_, constants, count / perGroup + 1);
  commands.barrier();
}

void ScanPass::demandNoOverflow() const {
  if (overflow_.mappedAs<std::uint32_t>()[0] != 0) {
    throw Error(ErrorCode::OutOfMemory, "more than 2^32 supersegments in one VDI", device_->name());
  }
}

}  // namespace vdi::gpu
