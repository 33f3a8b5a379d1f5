#include "vdi/gpu/RenderPass.h"

#include <algorithm>
#include <cassert>
#include <span>
#include <string_view>

#include "vdi/core/Camera.h"
#include "vdi/gpu/Device.h"

namespace vdi::gpu {

namespace {

ComputePipelineInfo renderInfo(std::string_view shader) {
  ComputePipelineInfo info = infoOf<shared::RenderRays>(shader);
  info.uniformBytes = sizeof(shared::RenderParams);
  return info;
}

/// Invocations that share a ray (render.comp). More invocations would take longer to set up than they save.
std::uint32_t lanesPerRayFor(const Device& device) {
  return device.runsGpuPrograms() && device.limits().subgroupSize > 0 ? 2 : 1;
}

/// The common course of a view's rays, taken from the middle ray.
struct Course {
  bool isNear = false;  // nearly along V_O's: rays meet many supersegments of each of a few lists
  glm::vec2 way{0.0F};  // columns and rows of V_O's picture that a ray crosses within the VDI's depths
};

Course courseOf(const shared::RenderParams& params, const shared::RenderRays& rays) {
  if (!(rays.directionBase.z > 0.0F)) return {};  // includes rays without a direction
  const bool parallel = params.parallel != 0;
  const auto placeAt = [&](float depth) {
    const float t = (depth - rays.originBase.z) / rays.directionBase.z;
    return glm::vec2(rays.originBase + t * rays.directionBase) / (parallel ? 1.0F : depth);
  };
  const glm::vec2 middle = placeAt(0.5F * (params.nearest + params.farthest));
  const glm::vec3 along = parallel ? glm::vec3(0.0F, 0.0F, 1.0F) : glm::vec3(middle, 1.0F);
  constexpr float cosine = 0.9914F;  // cosine of 7.5 degrees
  return {glm::dot(glm::normalize(rays.directionBase), glm::normalize(along)) > cosine,
          glm::abs(placeAt(params.farthest) - placeAt(params.nearest)) / params.pixelSize};
}

ComputePipelineInfo renderInfo(std::uint32_t lanes) {
  ComputePipelineInfo info = renderInfo("render");
  info.wholeSubgroups = lanes > 1;
  return info;
}

}  // namespace

float pixelSizeOf(const View& original) {
  return static_cast<float>(2.0 * original.halfHeight() / original.height());
}

shared::RenderParams renderGeometry(const View& original, const View& view) {
  shared::RenderParams params{};
  params.pixelSize = pixelSizeOf(original);
  params.parallel = original.parallel() ? 1U : 0U;
  params.width = static_cast<std::uint32_t>(view.width());
  params.height = static_cast<std::uint32_t>(view.height());
  params.lists = {original.width(), original.height()};
  // View guarantees this.
  assert(std::max(original.width(), original.height()) <= shared::renderMaxTiles * shared::renderTile);
  return params;
}

shared::RenderRays renderRays(const View& original, const View& view) {
  const auto toOriginal = [&](const glm::dvec3& direction) {
    return glm::dvec3(glm::dot(direction, original.right()), glm::dot(direction, original.up()),
                      glm::dot(direction, original.forward()));
  };
  const Ray middle = view.rayThrough(0.5 * view.width(), 0.5 * view.height());
  const Ray right = view.rayThrough(0.5 * view.width() + 1.0, 0.5 * view.height());
  const Ray up = view.rayThrough(0.5 * view.width(), 0.5 * view.height() + 1.0);
  return {original.toView(middle.origin),
          toOriginal(right.origin - middle.origin),
          toOriginal(up.origin - middle.origin),
          toOriginal(middle.direction),
          toOriginal(right.direction - middle.direction),
          toOriginal(up.direction - middle.direction)};
}

RenderPass::RenderPass(const std::shared_ptr<Device>& device)
    : device_(device),
      lanesPerRay_(lanesPerRayFor(*device)),
      cull_(device, renderInfo("cull")),
      render_(cull_, renderInfo(lanesPerRay_)),
      queue_(device, sizeof(shared::TileQueue), MemoryKind::DeviceLocal) {
  const shared::TileQueue empty{{0, 1, 1}, 0, 0, {}};
  Commands commands(device);
  commands.begin();
  commands.update(queue_, std::as_bytes(std::span(&empty, 1)));
  commands.submitAndWait();
}

std::vector<std::uint32_t> RenderPass::specialization(const shared::RenderParams& params,
                                                      const shared::RenderRays& rays,
                                                      Reconstruction reconstruction,
                                                      std::uint32_t form) const {
  const std::uint32_t smooth = reconstruction == Reconstruction::Constant ? 0 : 1;
  const std::uint32_t sheared = reconstruction == Reconstruction::Sheared ? 1 : 0;
  const std::uint32_t invocations = lanesPerRay_ * shared::renderPictureTile * shared::renderPictureTile;
  std::uint32_t segmentsAtOnce = 1;
  std::uint32_t pixelOrder = shared::renderOrderSquares;
  const Course course = courseOf(params, rays);
  const float crossed = glm::max(course.way.x, course.way.y);
  if (lanesPerRay_ > 1 && course.isNear && crossed >= 1.0F) {
    segmentsAtOnce = 3;
    pixelOrder = course.way.x == crossed ? shared::renderOrderColumns : shared::renderOrderRows;
  }
  return {smooth, lanesPerRay_, invocations, segmentsAtOnce, pixelOrder, form, sheared};
}

void RenderPass::compile(Reconstruction reconstruction, std::uint32_t form) const {
  render_.compile(specialization({}, {}, reconstruction, form));
}

void RenderPass::record(Commands& commands, shared::RenderParams params, const shared::RenderRays& rays,
                        Reconstruction reconstruction, std::uint32_t form) {
  const std::uint64_t tiles = std::uint64_t{groupsFor(params.width, shared::renderPictureTile)} *
                              groupsFor(params.height, shared::renderPictureTile);
  waiting_.reserve(device_, tiles * shared::renderKinds * sizeof(std::uint32_t), MemoryKind::DeviceLocal);
  params.queue = queue_.address();
  params.waiting = waiting_.address();
  cull_.update(commands, params);
  commands.dispatch(cull_.with({lanesPerRay_ > 1 ? 1U : 0U, form}), rays,
                    groupsFor(params.width, shared::renderRegion),
                    groupsFor(params.height, shared::renderRegion));
  commands.barrier();
  commands.dispatchIndirect(render_.with(specialization(params, rays, reconstruction, form)), rays, queue_);
}

}  // namespace vdi::gpu
