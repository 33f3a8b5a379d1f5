#include "vdi/gpu/ReducePass.h"

#include <algorithm>
#include <array>
#include <span>

#include "vdi/gpu/Device.h"

namespace vdi::gpu {

namespace {

ComputePipelineInfo subgroupInfo() {
  ComputePipelineInfo info = infoOf<shared::ReduceConstants>("reduce_subgroup");
  info.wholeSubgroups = true;
  return info;
}

/// Shared memory that every device has.
constexpr std::uint32_t sharedBytes = 16384;
/// Shared memory of a pre-segment in reduce_subgroup.comp.
constexpr std::uint32_t preSegmentBytes = 48;

/// Room for a list's pre-segments, limited by shared memory.
std::uint32_t subgroupCapacity(std::uint64_t preSegments) {
  constexpr std::uint64_t unit = 16;
  constexpr std::uint64_t largest = sharedBytes / preSegmentBytes / unit * unit;
  return static_cast<std::uint32_t>(std::min((preSegments + unit - 1) / unit * unit, largest));
}

}  // namespace

ReducePass::ReducePass(const std::shared_ptr<Device>& device)
    : ReducePass(device, device->runsGpuPrograms() && device->limits().subgroupSize > 0 ? Subgroups::Yes
                                                                                        : Subgroups::No) {}

ReducePass::ReducePass(std::shared_ptr<Device> device, Subgroups subgroups)
    : device_(std::move(device)),
      subgroups_(subgroups),
      find_(device_, infoOf<shared::ReduceConstants>("long_lists")),
      subgroup_(device_, subgroupInfo()),
      alone_(device_, infoOf<shared::ReduceConstants>("reduce")),
      store_(device_, infoOf<shared::ReduceConstants>("store")),
      longListCount_(device_, sizeof(std::uint32_t), MemoryKind::DeviceLocal) {}

void ReducePass::record(Commands& commands, shared::ReduceConstants constants, const MaxPerList& maxPerList) {
  bool alone = true;
  if (subgroups_ == Subgroups::Yes) {
    const std::uint64_t preSegments = shared::maxPreSegments(maxPerList.supersegments);
    constants.subgroupCapacity = subgroupCapacity(preSegments);
    alone = !maxPerList.always || preSegments > constants.subgroupCapacity;
    recordSubgroups(commands, constants);
  }
  if (alone) commands.dispatch(alone_, constants, groupsFor(constants.listCount, shared::reduceGroup));
  commands.barrier();
  commands.dispatch(store_.with({0, 0, constants.form.encoding, constants.fitting != 0 ? 1U : 0U}), constants,
                    groupsFor(constants.listCount, shared::storeGroup));
}

void ReducePass::recordSubgroups(Commands& commands, shared::ReduceConstants& constants) {
  longLists_.reserve(device_, std::uint64_t{constants.listCount} * sizeof(std::uint32_t),
                     MemoryKind::DeviceLocal);
  constants.longLists = longLists_.address();
  constants.longListCount = longListCount_.address();
  const std::array<std::uint32_t, 1> none{};
  commands.update(longListCount_, std::as_bytes(std::span(none)));
  commands.barrier();
  commands.dispatch(find_, constants, groupsFor(constants.listCount, shared::longListsGroup));
  commands.barrier();
  constexpr std::uint32_t maxSubgroups = 16384;  // enough for any device; each takes one list after another
  commands.dispatch(subgroup_.with({device_->limits().subgroupSize, constants.subgroupCapacity}), constants,
                    std::min(constants.listCount, maxSubgroups));
}

}  // namespace vdi::gpu
