#include "vdi/pipeline/VdiRenderer.h"

#include <algorithm>
#include <cassert>
#include <glm/trigonometric.hpp>
#include <mutex>
#include <utility>
#include <vector>

#include "vdi/core/Error.h"
#include "vdi/core/Parallel.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/Memory.h"
#include "vdi/gpu/RenderPass.h"
#include "vdi/pipeline/PictureBuffers.h"
#include "vdi/pipeline/VdiLoader.h"
#include "vdi/pipeline/VdiSink.h"

namespace vdi {

using gpu::MemoryKind;

struct VdiRenderer::State {
  explicit State(std::shared_ptr<gpu::Device> theDevice)
      : device(std::move(theDevice)), commands(device), expand(device), pass(device), loader(device) {}

  std::shared_ptr<gpu::Device> device;
  gpu::Commands commands;
  gpu::ExpandPass expand;
  gpu::RenderPass pass;
  detail::PictureBuffers picture;
  detail::LoadedVdi shown;
  detail::LoadedVdi prepared;
  double milliseconds = 0.0;
  std::vector<ClipPlane> clipPlanes;
  gpu::Buffer ends;  // ends of rays; empty until requested
  gpu::Buffer endsStaging;
  /// Declared after the data that it loads, because its destructor waits for its use.
  detail::VdiLoader loader;
  /// Whether `shown` may still be loading; the next render, or the next use of the loader, waits for it.
  bool loading = false;
  std::mutex loadingMutex;

  void waitForShown() {
    const std::scoped_lock lock(loadingMutex);
    if (std::exchange(loading, false)) loader.wait();
  }
  /// Renders into `picture`. `form` is one of shared::renderPicture....
  void render(const View& view, std::span<const float> rayEnds, Reconstruction reconstruction,
              std::uint32_t form);
};

VdiRenderer::VdiRenderer(std::shared_ptr<gpu::Device> device)
    : state_(std::make_unique<State>(std::move(device))) {}

VdiRenderer::~VdiRenderer() = default;

void VdiRenderer::setVdi(const Vdi& vdi) {
  state_->waitForShown();
  state_->loader.load(vdi, state_->shown, detail::VdiLoader::Kind::Alone);
  state_->loading = true;
}

void VdiRenderer::prepareVdi(const Vdi& vdi) {
  state_->waitForShown();
  try {
    state_->loader.load(vdi, state_->prepared, detail::VdiLoader::Kind::DuringRenders);
  } catch (...) {
    state_->prepared = {};
    throw;
  }
}

namespace {

/// Loads bands of lists for the renderer.
class LoaderSink final : public detail::VdiSink {
 public:
  LoaderSink(detail::VdiLoader& loader, detail::LoadedVdi& target) : loader_(loader), target_(target) {}

  void begin(const Vdi& header) override { loader_.begin(header, target_); }
  gpu::Submission add(const Band& band, const Wait& wait, RankReport&) override {
    wait();
    return loader_.add(band.lists, band.firstList);
  }
  void finish(RankReport&) override { loader_.finish(); }
  void fail() noexcept override {
    loader_.drop();
    target_.original.reset();
  }

 private:
  detail::VdiLoader& loader_;
  detail::LoadedVdi& target_;
};

}  // namespace

std::unique_ptr<detail::VdiSink> VdiRenderer::sinkFor(const gpu::Device& device) {
  if (&device != state_->device.get()) return nullptr;
  state_->waitForShown();
  state_->loading = true;
  return std::make_unique<LoaderSink>(state_->loader, state_->shown);
}

bool VdiRenderer::showPrepared() {
  if (!state_->prepared.original) return false;
  std::swap(state_->shown, state_->prepared);
  state_->prepared.original.reset();
  return true;
}

void VdiRenderer::setClipPlanes(std::vector<ClipPlane> planes) {
  validate(Region{.box = {}, .planes = planes});
  state_->clipPlanes = std::move(planes);
}

namespace {

/// Sets the planes in the view space of V_O.
void clipBy(shared::RenderParams& params, std::span<const ClipPlane> planes, const View& original) {
  static_assert(maxClipPlanes == shared::renderMaxClipPlanes);
  params.clipPlaneCount = static_cast<std::uint32_t>(planes.size());
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const glm::dvec3 unit = glm::normalize(planes[i].normal);
    const glm::dvec3 normal(glm::dot(unit, original.right()), glm::dot(unit, original.up()),
                            glm::dot(unit, original.forward()));
    params.clipPlanes[i] = glm::dvec4(normal, glm::dot(normal, original.toView(planes[i].origin)));
  }
}

}  // namespace

void VdiRenderer::State::render(const View& view, std::span<const float> rayEnds,
                                Reconstruction reconstruction, std::uint32_t form) {
  if (!shown.original) throw Error(ErrorCode::InvalidArgument, "there is no VDI to render yet");
  const std::uint64_t pixels =
      static_cast<std::uint64_t>(view.width()) * static_cast<std::uint64_t>(view.height());
  assert(rayEnds.empty() || rayEnds.size() == pixels);
  picture.reserve(device, pixels,
                  form == shared::renderPictureFloats ? sizeof(glm::vec4) : sizeof(glm::u8vec4));
  waitForShown();
  const shared::DepthRange depths = shown.depths();
  shared::RenderParams params = gpu::renderGeometry(*shown.original, view);
  params.heads = shown.heads.address();
  params.segments = shown.segments.address();
  params.tileDepthMasks = shown.tileDepthMasks.address();
  params.binScale = depths.binScale;
  params.colors = picture.colors();
  params.depths = picture.depths();
  params.nearest = depths.nearest;
  params.farthest = depths.farthest;
  const float middle = params.parallel != 0 ? 1.0F : 0.5F * (depths.nearest + depths.farthest);
  params.slopeUnit = params.pixelSize * middle * (shared::renderMaxSlope / shared::renderSlopes);
  clipBy(params, clipPlanes, *shown.original);
  if (!rayEnds.empty()) {
    endsStaging.reserve(device, rayEnds.size_bytes(), MemoryKind::Upload);
    ends.reserve(device, rayEnds.size_bytes(), MemoryKind::DeviceLocal);
    copyInParallel(std::as_bytes(rayEnds), endsStaging.mapped().data());
    params.ends = ends.address();
    params.hasEnds = 1;
  }
  commands.begin();
  if (reconstruction == Reconstruction::Sheared) {
    if (!shown.leans) detail::recordLeaning(commands, expand, device, shown);
    params.slopes = shown.slopes.address();
    std::ranges::copy(detail::facesForDevice(shown), params.boxFaces);
  }
  commands.mark("render");
  if (!rayEnds.empty()) {
    commands.copy(endsStaging, 0, ends, 0, rayEnds.size_bytes());
    commands.barrier();
  }
  pass.record(commands, params, gpu::renderRays(*shown.original, view), reconstruction, form);
  picture.recordDownload(commands);
  commands.submitAndWait();
  milliseconds = commands.stageTimes().front().milliseconds;
}

Image VdiRenderer::render(const Camera& camera, int width, int height, Reconstruction reconstruction) {
  return render(View(camera, width, height), {}, reconstruction);
}

Image VdiRenderer::render(const View& view, std::span<const float> ends, Reconstruction reconstruction) {
  state_->render(view, ends, reconstruction, shared::renderPictureFloats);
  Image image{view.width(), view.height(), {}, {}};
  state_->picture.copyTo(image, 0);
  return image;
}

ImageBytes VdiRenderer::renderBytes(const Camera& camera, int width, int height, Alpha alpha,
                                    Reconstruction reconstruction) {
  return renderBytes(View(camera, width, height), {}, alpha, reconstruction);
}

ImageBytes VdiRenderer::renderBytes(const View& view, std::span<const float> ends, Alpha alpha,
                                    Reconstruction reconstruction) {
  state_->render(view, ends, reconstruction,
                 alpha == Alpha::Straight ? shared::renderPictureStraightBytes : shared::renderPictureBytes);
  return state_->picture.bytes(view.width(), view.height());
}

void VdiRenderer::compile(Reconstruction reconstruction) const {
  state_->pass.compile(reconstruction, shared::renderPictureBytes);
}

double VdiRenderer::renderMilliseconds() const {
  return state_->milliseconds;
}

}  // namespace vdi
