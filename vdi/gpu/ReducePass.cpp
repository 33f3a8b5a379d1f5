#include "vdi/gpu/ReducePass.h"

#include <algorithm>
#include <array>
#include <span>

#include "vdi/gpu/Device.h"

namespace vdi::gpu {

namespace {

ComputePipelineInfo pipelineInfo(std::string_view shader) {
  ComputePipelineInfo info;
  info.shader = shader;
  info.pushConstantBytes = sizeof(shared::ReduceConstants);
  return info;
}

ComputePipelineInfo teamInfo() {
  ComputePipelineInfo info = pipelineInfo("reduce_team");
  info.wholeSubgroups = true;
  return info;
}

/// Of shared memory, which every device has.
constexpr std::uint32_t sharedBytes = 16384;
/// What a grain takes of it in reduce_team.comp.
constexpr std::uint32_t grainBytes = 48;

/// What a list takes, as far as there's room for that.
std::uint32_t teamCapacity(std::uint64_t grains) {
  constexpr std::uint64_t unit = 16;
  constexpr std::uint64_t largest = sharedBytes / grainBytes / unit * unit;
  return static_cast<std::uint32_t>(std::min((grains + unit - 1) / unit * unit, largest));
}

}  // namespace

ReducePass::ReducePass(const std::shared_ptr<Device>& device)
    : ReducePass(device,
                 device->runsGpuPrograms() && device->limits().subgroupSize > 0 ? Teams::Yes : Teams::No) {}

ReducePass::ReducePass(std::shared_ptr<Device> device, Teams teams)
    : device_(std::move(device)),
      teams_(teams),
      find_(device_, pipelineInfo("queue")),
      team_(device_, teamInfo()),
      alone_(device_, pipelineInfo("reduce")),
      store_(device_, pipelineInfo("store")),
      queued_(device_, sizeof(std::uint32_t), MemoryKind::DeviceLocal) {}

void ReducePass::record(Commands& commands, shared::ReduceConstants constants, const MostPerList& most) {
  bool alone = true;
  if (teams_ == Teams::Yes) {
    const std::uint64_t grains = shared::mostGrains(most.supersegments);
    constants.teamCapacity = teamCapacity(grains);
    alone = !most.always || grains > constants.teamCapacity;
    recordTeams(commands, constants);
  }
  if (alone) commands.dispatch(alone_, constants, groupsFor(constants.listCount, shared::reduceGroup));
  commands.barrier();
  commands.dispatch(store_.with({0, 0, isCompact(constants.form), constants.fitting != 0 ? 1U : 0U}), constants,
                    groupsFor(constants.listCount, shared::storeGroup));
}

void ReducePass::recordTeams(Commands& commands, shared::ReduceConstants& constants) {
  queue_.reserve(device_, std::uint64_t{constants.listCount} * sizeof(std::uint32_t),
                 MemoryKind::DeviceLocal);
  constants.queue = queue_.address();
  constants.queued = queued_.address();
  const std::array<std::uint32_t, 1> none{};
  commands.update(queued_, std::as_bytes(std::span(none)));
  commands.barrier();
  commands.dispatch(find_, constants, groupsFor(constants.listCount, shared::queueGroup));
  commands.barrier();
  constexpr std::uint32_t mostTeams = 16384;  // enough for any device; each takes list after list
  commands.dispatch(team_.with({device_->limits().subgroupSize, constants.teamCapacity}), constants,
                    std::min(constants.listCount, mostTeams));
}

}  // namespace vdi::gpu
