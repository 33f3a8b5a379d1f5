// VdiRenderer and flatten: what a viewer does with a VDI.
#include <algorithm>
#include <cassert>
#include <cmath>
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
#include "vdi/pipeline/Pipeline.h"
#include "vdi/pipeline/VdiLoader.h"

namespace vdi {

using gpu::MemoryKind;

struct VdiRenderer::State {
  explicit State(std::shared_ptr<gpu::Device> theDevice)
      : device(std::move(theDevice)), commands(device), pass(device), loader(device) {}

  std::shared_ptr<gpu::Device> device;
  gpu::Commands commands;
  gpu::RenderPass pass;
  detail::PictureBuffers picture;
  detail::LoadedVdi shown;
  detail::LoadedVdi prepared;
  double milliseconds = 0.0;
  gpu::Buffer ends;  // of rays; none until they're asked for
  gpu::Buffer endsStaging;
  /// Behind what it loads, for its end waits for what uses that.
  detail::VdiLoader loader;
  /// `shown` may still be on its way: a render waits for it, or who uses the loader next.
  bool loading = false;
  std::mutex loadingMutex;

  void waitForShown() {
    const std::scoped_lock lock(loadingMutex);
    if (std::exchange(loading, false)) loader.wait();
  }
  /// Into `picture`. `form`: shared::renderPicture...
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
    state_->loader.load(vdi, state_->prepared, detail::VdiLoader::Kind::Beside);
  } catch (...) {
    state_->prepared = {};
    throw;
  }
}

detail::VdiLoader& VdiRenderer::loadShown(const Vdi& header) {
  state_->waitForShown();
  state_->loader.begin(header, state_->shown);
  state_->loading = true;
  return state_->loader;
}

void VdiRenderer::showNothing() {
  state_->loader.drop();
  state_->loading = false;
  state_->shown.original.reset();
}

const gpu::Device* VdiRenderer::device() const {
  return state_->device.get();
}

bool VdiRenderer::showPrepared() {
  if (!state_->prepared.original) return false;
  std::swap(state_->shown, state_->prepared);
  state_->prepared.original.reset();
  return true;
}

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
  if (!rayEnds.empty()) {
    endsStaging.reserve(device, rayEnds.size_bytes(), MemoryKind::Upload);
    ends.reserve(device, rayEnds.size_bytes(), MemoryKind::DeviceLocal);
    copyInParallel(std::as_bytes(rayEnds), endsStaging.mapped().data());
    params.ends = ends.address();
    params.hasEnds = 1;
  }
  commands.begin();
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

double VdiRenderer::renderMilliseconds() const {
  return state_->milliseconds;
}

namespace {

/// `value`: a supersegment as floats.
/// Of the lists' columns and rows, those from `margin` on.
template <typename Segment, typename Value>
void flattenLists(const ListsOf<Segment>& lists, int listsWide, const glm::ivec2& margin, Value value,
                  Image& image) {
  constexpr float opaque = 0.999999F;
  constexpr std::size_t minimum = 4096;  // lists
  inParallel(image.pixelCount(), minimum, [&](std::size_t first, std::size_t last) {
    const auto width = static_cast<std::size_t>(image.width);
    for (std::size_t i = first; i < last; ++i) {
      const std::size_t column = i % width + static_cast<std::size_t>(margin.x);
      const std::size_t row = i / width + static_cast<std::size_t>(margin.y);
      const std::span<const Segment> list = lists.list(row * static_cast<std::size_t>(listsWide) + column);
      glm::vec4 sum(0.0F);
      for (auto segment = list.begin(); segment != list.end() && sum.a < opaque; ++segment) {
        const Supersegment& s = value(*segment);
        sum += (1.0F - sum.a) * glm::vec4(s.red, s.green, s.blue, s.opacity);
      }
      image.rgba[i] = sum;
      image.depth[i] = list.empty() ? Image::noDepth : value(list.front()).front;
    }
  });
}

}  // namespace

namespace {

/// `columns`, `rows`: of the lists that are taken, in [0, size), or -1: an empty one.
template <typename Segment>
ListsOf<Segment> taken(const ListsOf<Segment>& lists, int width, const std::vector<int>& columns,
                       const std::vector<int>& rows) {
  ListsOf<Segment> few;
  few.offsets.assign(1, 0);
  few.offsets.reserve(columns.size() * rows.size() + 1);
  for (const int row : rows) {
    for (const int column : columns) {
      if (row >= 0 && column >= 0) {
        const std::span<const Segment> list =
            lists.list(static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                       static_cast<std::size_t>(column));
        few.segments.insert(few.segments.end(), list.begin(), list.end());
      }
      few.offsets.push_back(static_cast<std::uint32_t>(few.segments.size()));
    }
  }
  return few;
}

/// Which of `many` lists along an axis is at the centre of each of `few`, which cover `share` as much of it.
std::vector<int> placesOf(int few, int many, double share) {
  std::vector<int> places(static_cast<std::size_t>(few));
  for (int i = 0; i < few; ++i) {
    const double at = 0.5 + ((i + 0.5) / few - 0.5) * share;
    const int place = static_cast<int>(std::floor(at * many));
    places[static_cast<std::size_t>(i)] = place >= 0 && place < many ? place : -1;
  }
  return places;
}

}  // namespace

Vdi thinned(const Vdi& vdi, int factor) {
  assert(factor >= 1);
  Vdi few;
  few.camera = vdi.camera;
  // As high as all lists.
  const double halfHeight = vdi.view().halfHeight();
  if (vdi.camera.parallelProjection) {
    few.camera.parallelScale = halfHeight;
  } else {
    few.camera.viewAngle = glm::degrees(2.0 * std::atan(halfHeight));
  }
  few.width = (vdi.width + factor - 1) / factor;
  few.height = (vdi.height + factor - 1) / factor;
  few.budget = vdi.budget;
  few.bounds = vdi.bounds;
  few.sampleStep = vdi.sampleStep;
  few.time = vdi.time;
  few.timeStep = vdi.timeStep;
  few.depthCode = vdi.depthCode;
  // Pixels are squares: what the width is then differs by rounding.
  const double share =
      (static_cast<double>(few.width) * vdi.height) / (static_cast<double>(few.height) * vdi.width);
  const std::vector<int> columns = placesOf(few.width, vdi.width, share);
  const std::vector<int> rows = placesOf(few.height, vdi.height, 1.0);
  std::visit([&](const auto& lists) { few.lists = taken(lists, vdi.width, columns, rows); }, vdi.lists);
  return few;
}

Image flatten(const Vdi& vdi) {
  const glm::ivec2 size = vdi.pictureSize();
  Image image{size.x, size.y, {}, {}};
  image.rgba.resize(image.pixelCount());
  image.depth.resize(image.pixelCount());
  if (const auto* compact = std::get_if<CompactLists>(&vdi.lists)) {
    flattenLists(
        *compact, vdi.width, vdi.margin,
        [&](const CompactSupersegment& s) { return expanded(s, vdi.depthCode); }, image);
  } else {
    flattenLists(
        std::get<SupersegmentLists>(vdi.lists), vdi.width, vdi.margin,
        [](const Supersegment& s) -> const Supersegment& { return s; }, image);
  }
  return image;
}

}  // namespace vdi
