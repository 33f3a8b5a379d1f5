#include "vdi/gpu/ScanPass.h"

#include <algorithm>
#include <utility>

#include "vdi/core/Error.h"
#include "vdi/gpu/Device.h"

namespace vdi::gpu {

namespace {

constexpr std::uint32_t perGroup = shared::scanGroup * shared::scanPerThread;

}  // namespace

ScanPass::ScanPass(std::shared_ptr<Device> device)
    : device_(std::move(device)),
      pipelines_(device_, infoOf<shared::ScanConstants>("scan")),
      overflow_(device_, sizeof(std::uint32_t), MemoryKind::Readback) {}

void ScanPass::recordBoth(Commands& commands, shared::ScanConstants constants, ComputePipeline& pipeline) {
  overflow_.mappedAs<std::uint32_t>()[0] = 0;
  const std::uint32_t groups = constants.count / perGroup + 1;
  const std::uint64_t sumBytes = std::uint64_t{groups} * sizeof(std::uint32_t);
  if (!sums_ || sums_.size() < sumBytes) {
    outgrown_.push_back(std::move(sums_));
    sums_ = Buffer(device_, sumBytes + sumBytes / 2, MemoryKind::DeviceLocal);
  }
  constants.sums = sums_.address();
  constants.overflow = overflow_.address();
  constants.mode = shared::scanModeSum;
  commands.barrier();
  commands.dispatch(pipeline, constants, groups);
  commands.barrier();
  constants.mode = shared::scanModeAdd;
  commands.dispatch(pipeline, constants, groups);
  commands.barrier();
}

void ScanPass::record(Commands& commands, const Buffer& values, const Buffer& prefix, std::uint32_t count) {
  shared::ScanConstants constants{};
  constants.values = values.address();
  constants.prefix = prefix.address();
  constants.count = count;
  recordBoth(commands, constants, pipelines_.with({0, 0}));
}

void ScanPass::record(Commands& commands, const Buffer& values, const Buffer& prefix, std::uint32_t count,
                      const Buffer& guard, std::uint64_t room, const Buffer* before) {
  shared::ScanConstants constants{};
  constants.values = values.address();
  constants.prefix = prefix.address();
  constants.count = count;
  constants.guard = guard.address();
  constants.guardBefore = before != nullptr ? before->address() : 0;
  constants.room = static_cast<std::uint32_t>(std::min<std::uint64_t>(room, 0xffffffffU));
  recordBoth(commands, constants, pipelines_.with({1, before != nullptr ? 1U : 0U}));
}

void ScanPass::recordRebase(Commands& commands, const Buffer& prefix, std::uint64_t first,
                            std::uint32_t count, std::uint32_t base) {
  if (count == 0 || base == 0) return;
  shared::ScanConstants constants{};
  constants.prefix = prefix.address() + first * sizeof(std::uint32_t);
  constants.count = count - 1;  // the shader writes one more
  constants.mode = shared::scanModeRebase;
  constants.base = base;
  commands.barrier();
  commands.dispatch(pipelines_.with({0, 0}), constants, count / perGroup + 1);
  commands.barrier();
}

void ScanPass::requireNoOverflow() const {
  if (overflow_.mappedAs<std::uint32_t>()[0] != 0) {
    throw Error(ErrorCode::OutOfMemory, "more than 2^32 supersegments in one VDI", device_->name());
  }
}

}  // namespace vdi::gpu
