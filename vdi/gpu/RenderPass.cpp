#include "vdi/gpu/RenderPass.h"

#include <algorithm>
#include <cassert>

#include "vdi/core/Camera.h"

namespace vdi::gpu {

namespace {

ComputePipelineInfo pipelineInfo() {
  ComputePipelineInfo info;
  info.shader = "render";
  info.uniformBytes = sizeof(shared::RenderParams);
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

RenderPass::RenderPass(std::shared_ptr<Device> device) : pipelines_(std::move(device), pipelineInfo()) {}

void RenderPass::record(Commands& commands, const shared::RenderParams& params,
                        Reconstruction reconstruction) {
  const std::uint32_t smooth = reconstruction == Reconstruction::Smooth ? 1 : 0;
  pipelines_.update(commands, params);
  commands.dispatchBytes(pipelines_.with({0, 0, isCompact(params.form), smooth}), {},
                         (params.width + shared::renderGroupX - 1) / shared::renderGroupX,
                         (params.height + shared::renderGroupY - 1) / shared::renderGroupY, 1);
}

}  // namespace vdi::gpu
