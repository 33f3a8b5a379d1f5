#include "vdi/gpu/RenderPass.h"

#include <algorithm>
#include <cassert>
#include <span>
#include <string_view>

#include "vdi/core/Camera.h"
#include "vdi/gpu/Device.h"

namespace vdi::gpu {

namespace {

ComputePipelineInfo pipelineInfo(std::string_view shader) {
  ComputePipelineInfo info;
  info.shader = shader;
  info.uniformBytes = sizeof(shared::RenderParams);
  return info;
}

/// Invocations that share a ray (render.comp). With more, what each of them has to set up costs more than
/// they save.
std::uint32_t sharesFor(const Device& device) {
  return device.runsGpuPrograms() && device.limits().subgroupSize > 0 ? 2 : 1;
}

ComputePipelineInfo renderInfo(std::uint32_t shares) {
  ComputePipelineInfo info = pipelineInfo("render");
  info.wholeSubgroups = shares > 1;
  return info;
}

}  // namespace

shared::RenderParams renderGeometry(const View& original, const View& view) {
  shared::RenderParams params{};
  const auto toOriginal = [&](const glm::dvec3& direction) {
    return glm::dvec3(glm::dot(direction, original.right()), glm::dot(direction, original.up()),
                      glm::dot(direction, original.forward()));
  };
  const Ray middle = view.rayThrough(0.5 * view.width(), 0.5 * view.height());
  const Ray right = view.rayThrough(0.5 * view.width() + 1.0, 0.5 * view.height());
  const Ray up = view.rayThrough(0.5 * view.width(), 0.5 * view.height() + 1.0);
  params.originBase = original.toView(middle.origin);
  params.originRight = toOriginal(right.origin - middle.origin);
  params.originUp = toOriginal(up.origin - middle.origin);
  params.directionBase = toOriginal(middle.direction);
  params.directionRight = toOriginal(right.direction - middle.direction);
  params.directionUp = toOriginal(up.direction - middle.direction);
  params.pixelSize = static_cast<float>(2.0 * original.halfHeight() / original.height());
  params.parallel = original.parallel() ? 1U : 0U;
  params.width = static_cast<std::uint32_t>(view.width());
  params.height = static_cast<std::uint32_t>(view.height());
  params.lists = {original.width(), original.height()};
  // View allows no more.
  assert(std::max(original.width(), original.height()) <= shared::renderMostMarks * shared::renderTile);
  return params;
}

RenderPass::RenderPass(const std::shared_ptr<Device>& device)
    : device_(device),
      shares_(sharesFor(*device)),
      beams_(device, pipelineInfo("beams")),
      render_(beams_, renderInfo(shares_)),
      queue_(device, sizeof(shared::TileQueue), MemoryKind::DeviceLocal) {}

void RenderPass::record(Commands& commands, shared::RenderParams params, Reconstruction reconstruction) {
  const std::uint64_t tiles = std::uint64_t{groupsFor(params.width, shared::renderPictureTile)} *
                              groupsFor(params.height, shared::renderPictureTile);
  waiting_.reserve(device_, tiles * shared::renderKinds * sizeof(std::uint32_t), MemoryKind::DeviceLocal);
  params.queue = queue_.address();
  params.waiting = waiting_.address();
  const shared::TileQueue none{{0, 1, 1}, 0, {}};
  commands.update(queue_, std::as_bytes(std::span(&none, 1)));
  beams_.update(commands, params);
  commands.dispatchBytes(beams_.with({shares_ > 1 ? 1U : 0U}), {},
                         groupsFor(params.width, shared::renderRegion),
                         groupsFor(params.height, shared::renderRegion), 1);
  commands.barrier();
  const std::uint32_t smooth = reconstruction == Reconstruction::Smooth ? 1 : 0;
  const std::uint32_t invocations = shares_ * shared::renderPictureTile * shared::renderPictureTile;
  commands.dispatchIndirect(render_.with({smooth, shares_, invocations}), queue_);
}

}  // namespace vdi::gpu
