// VdiRenderer and flatten: what a viewer does with a VDI.
#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <glm/trigonometric.hpp>
#include <mutex>
#include <utility>
#include <vector>

#include "vdi/core/Error.h"
#include "vdi/core/Parallel.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/ExpandPass.h"
#include "vdi/gpu/Memory.h"
#include "vdi/gpu/RenderPass.h"
#include "vdi/pipeline/ListBuilder.h"
#include "vdi/pipeline/PictureBuffers.h"
#include "vdi/pipeline/Pipeline.h"

namespace vdi {

using gpu::MemoryKind;

namespace {

/// A VDI on the device.
struct Uploaded {
  gpu::Buffer segments;
  gpu::Buffer heads;
  gpu::Buffer tileDepthMasks;
  std::unique_ptr<View> original;  // none until there's a VDI
  float nearest = 0.0F;
  float farthest = 0.0F;
  float binScale = 0.0F;
};

/// Whether an upload has the device to itself, or renders go on beside it.
enum class UploadKind { Alone, Beside };

}  // namespace

struct VdiRenderer::State {
  explicit State(std::shared_ptr<gpu::Device> theDevice)
      : device(std::move(theDevice)), commands(device), pass(device), expand(device), uploads(device) {}

  std::shared_ptr<gpu::Device> device;
  gpu::Commands commands;
  gpu::RenderPass pass;
  gpu::ExpandPass expand;
  gpu::Buffer staging;
  gpu::Buffer offsets;
  detail::PictureBuffers picture;
  Uploaded shown;
  Uploaded prepared;
  double milliseconds = 0.0;

  gpu::Buffer ends;  // of rays; none until they're asked for
  gpu::Buffer endsStaging;

  /// Into `picture`. `form`: shared::renderPicture...
  void render(const View& view, std::span<const float> rayEnds, Reconstruction reconstruction,
              std::uint32_t form);

  /// What fits is on its way while the caller goes on; more waits for the part before.
  static constexpr std::uint64_t aloneBytes = std::uint64_t{128} << 20;
  /// A render waits for the part that's on its way.
  static constexpr std::uint64_t besideBytes = std::uint64_t{2} << 20;
  std::uint64_t stagingBytes = 0;  // of the staging buffer that are used
  std::uint64_t stagingUsed = 0;
  /// Of setVdi, which doesn't wait for the last of them. Behind the buffers, for its end waits for what uses
  /// them.
  gpu::Commands uploads;

  /// Calls use(at, first, count) for parts of `values` that lie in staging, `at` bytes into it.
  template <typename T, typename Use>
  void inParts(const HostVector<T>& values, Use use) {
    for (std::size_t first = 0; first < values.size();) {
      if (stagingUsed + sizeof(T) > stagingBytes) {
        uploads.submitAndWait();
        uploads.begin();
        stagingUsed = 0;
      }
      const std::size_t count =
          std::min<std::size_t>((stagingBytes - stagingUsed) / sizeof(T), values.size() - first);
      std::memcpy(staging.mapped().data() + stagingUsed, values.data() + first, count * sizeof(T));
      use(stagingUsed, first, count);
      constexpr std::uint64_t alignment = 16;
      stagingUsed += (count * sizeof(T) + alignment - 1) / alignment * alignment;
      first += count;
    }
  }

  template <typename Segment>
  void upload(const ListsOf<Segment>& lists, const DepthCode& code, const glm::ivec2& size, Uploaded& target,
              UploadKind kind) {
    uploads.wait();  // for the last one, which may still use the buffers
    offsets.reserve(device, lists.offsets.size() * sizeof(std::uint32_t), MemoryKind::DeviceLocal);
    target.segments.reserve(device, lists.segments.size() * sizeof(shared::RenderSegment),
                            MemoryKind::DeviceLocal);
    target.heads.reserve(device, lists.listCount() * sizeof(shared::ListHead), MemoryKind::DeviceLocal);
    target.tileDepthMasks.reserve(device, gpu::tileCount(size) * sizeof(std::uint64_t),
                                  MemoryKind::DeviceLocal);
    const std::uint64_t bytes =
        (lists.offsets.size() + 4) * sizeof(std::uint32_t) + lists.segments.size() * sizeof(Segment);
    stagingBytes = std::min(bytes, kind == UploadKind::Alone ? aloneBytes : besideBytes);
    staging.reserve(device, stagingBytes, MemoryKind::Upload);
    stagingUsed = 0;
    uploads.begin();
    inParts(lists.offsets, [&](std::uint64_t at, std::size_t first, std::size_t count) {
      uploads.copy(staging, at, offsets, first * sizeof(std::uint32_t), count * sizeof(std::uint32_t));
    });
    shared::ExpandConstants constants{};
    constants.offsets = offsets.address();
    constants.segments = target.segments.address();
    constants.heads = target.heads.address();
    constants.tileDepthMasks = target.tileDepthMasks.address();
    constants.nearest = target.nearest;
    constants.binScale = target.binScale;
    constants.lists = size;
    constants.form = detail::storedForm(code);
    constants.mode = shared::expandModeSegments;
    inParts(lists.segments, [&](std::uint64_t at, std::size_t first, std::size_t count) {
      constants.from = staging.address() + at;
      constants.first = static_cast<std::uint32_t>(first);
      constants.count = static_cast<std::uint32_t>(count);
      expand.record(uploads, constants);
    });
    for (const std::uint32_t mode :
         {shared::expandModeMasks, shared::expandModeTiles, shared::expandModeLargeTiles}) {
      uploads.barrier();
      constants.mode = mode;
      expand.record(uploads, constants);
    }
    if (kind == UploadKind::Alone) {
      uploads.submit();
    } else {
      uploads.submitAndWait();
    }
  }

  void upload(const Vdi& vdi, Uploaded& target, UploadKind kind);
};

namespace {

struct DepthRange {
  float nearest = Image::noDepth;
  float farthest = 0.0F;
};

float frontOf(const Supersegment& segment, const DepthCode&) {
  return segment.front;
}
float backOf(const Supersegment& segment, const DepthCode&) {
  return segment.back;
}
float frontOf(const CompactSupersegment& segment, const DepthCode& code) {
  return code.depthOf(segment.front());
}
float backOf(const CompactSupersegment& segment, const DepthCode& code) {
  return code.depthOf(segment.back());
}

template <typename Segment>
DepthRange depthsOf(const ListsOf<Segment>& lists, const DepthCode& code) {
  DepthRange all;
  std::mutex mutex;
  constexpr std::size_t minimum = 1U << 16;  // lists
  inParallel(lists.listCount(), minimum, [&](std::size_t first, std::size_t last) {
    DepthRange own;
    for (std::size_t i = first; i < last; ++i) {
      const std::span<const Segment> list = lists.list(i);
      if (list.empty()) continue;
      own.nearest = std::min(own.nearest, frontOf(list.front(), code));
      own.farthest = std::max(own.farthest, backOf(list.back(), code));
    }
    const std::scoped_lock lock(mutex);
    all.nearest = std::min(all.nearest, own.nearest);
    all.farthest = std::max(all.farthest, own.farthest);
  });
  return all;
}

}  // namespace

VdiRenderer::VdiRenderer(std::shared_ptr<gpu::Device> device)
    : state_(std::make_unique<State>(std::move(device))) {}

VdiRenderer::~VdiRenderer() = default;

void VdiRenderer::State::upload(const Vdi& vdi, Uploaded& target, UploadKind kind) {
  target.original.reset();
  const DepthRange depths =
      std::visit([&](const auto& lists) { return depthsOf(lists, vdi.depthCode); }, vdi.lists);
  target.nearest = depths.nearest;
  target.farthest = depths.farthest;
  // In perspective the frusta of V_O's pixels meet in its eye; nothing can be told apart there.
  if (!vdi.camera.parallelProjection) target.nearest = std::max(target.nearest, target.farthest * 1e-6F);
  target.binScale =
      target.farthest > target.nearest ? shared::renderBins / (target.farthest - target.nearest) : 0.0F;
  std::visit(
      [&](const auto& lists) {
        upload(lists, vdi.depthCode, {vdi.width, vdi.height}, target, kind);
      },
      vdi.lists);
  target.original = std::make_unique<View>(vdi.view());
}

void VdiRenderer::setVdi(const Vdi& vdi) {
  state_->upload(vdi, state_->shown, UploadKind::Alone);
}

void VdiRenderer::prepareVdi(const Vdi& vdi) {
  try {
    state_->upload(vdi, state_->prepared, UploadKind::Beside);
  } catch (...) {
    state_->prepared = {};
    throw;
  }
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
  shared::RenderParams params = gpu::renderGeometry(*shown.original, view);
  params.heads = shown.heads.address();
  params.segments = shown.segments.address();
  params.tileDepthMasks = shown.tileDepthMasks.address();
  params.binScale = shown.binScale;
  params.colors = picture.colors();
  params.depths = picture.depths();
  params.nearest = shown.nearest;
  params.farthest = shown.farthest;
  if (!rayEnds.empty()) {
    endsStaging.reserve(device, rayEnds.size_bytes(), MemoryKind::Upload);
    ends.reserve(device, rayEnds.size_bytes(), MemoryKind::DeviceLocal);
    copyInParallel(std::as_bytes(rayEnds), endsStaging.mapped().data());
    params.ends = ends.address();
    params.hasEnds = 1;
  }
  commands.begin();  // behind setVdi's uploads
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
