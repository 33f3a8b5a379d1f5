#include "vdi/pipeline/RayCaster.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>
#include <ranges>

#include "shaders/shared/quota.h"

namespace vdi::detail {

namespace shared = gpu::shared;

RayCaster::RayCaster(std::shared_ptr<gpu::Device> device, std::uint32_t bands)
    : device_(std::move(device)),
      bands_(bands),
      volume_(device_),
      pass_(device_),
      builders_{ListBuilder(device_), ListBuilder(device_)},
      commands_(device_),
      quota_(device_, gpu::infoOf<shared::QuotaConstants>("quota")),
      histogram_(device_) {}

namespace {

void setLights(shared::CastParams& params, const Shading& shading, const View& view) {
  static_assert(maxLights == shared::castMaxLights &&
                static_cast<float>(leastGradient) == shared::leastGradient);
  params.shaded = shading.on ? 1U : 0U;
  params.ambient = static_cast<float>(shading.ambient);
  params.lightCount = static_cast<std::uint32_t>(shading.lights.size());
  for (std::size_t i = 0; i < shading.lights.size(); ++i) {
    params.lightDirections[i] = worldDirection(shading.lights[i], view);
    params.lightColors[i] = shading.diffuse * shading.lights[i].color;
  }
}

void setRegion(shared::CastParams& params, const Region& region, const Scene& scene) {
  static_assert(maxClipPlanes == shared::castMaxClipPlanes);
  const Box shown = boundsIn(region, scene.bounds);
  for (int axis = 0; axis < 3; ++axis) {
    params.sceneLo[axis] = snapToScene(scene, shown.lo[axis], axis);
    params.sceneHi[axis] = snapToScene(scene, shown.hi[axis], axis);
  }
  params.clipPlaneCount = static_cast<std::uint32_t>(region.planes.size());
  for (std::size_t i = 0; i < region.planes.size(); ++i) {
    const ClipPlane& plane = region.planes[i];
    const glm::dvec3 normal = glm::normalize(plane.normal);
    params.clipPlanes[i] = glm::dvec4(normal, glm::dot(normal, plane.origin - scene.bounds.center()));
  }
}

void setBlending(shared::CastParams& params, const Blending& blending, const TransferTable& table) {
  static_assert(maxIsovalues == shared::castMaxIsosurfaces);
  static_assert(static_cast<std::uint32_t>(BlendMode::Composite) == shared::blendComposite &&
                static_cast<std::uint32_t>(BlendMode::Maximum) == shared::blendMaximum &&
                static_cast<std::uint32_t>(BlendMode::Minimum) == shared::blendMinimum &&
                static_cast<std::uint32_t>(BlendMode::Isosurface) == shared::blendIsosurface);
  params.blendMode = static_cast<std::uint32_t>(blending.mode);
  for (const Isosurface& surface : isosurfacesOf(blending, table)) {
    params.isosurfacePositions[params.isosurfaceCount] = static_cast<float>(surface.position);
    params.isosurfaceMaterials[params.isosurfaceCount] = surface.material;
    ++params.isosurfaceCount;
  }
}

template <typename T>
std::byte* bytesOf(HostVector<T>& values) {
  return std::as_writable_bytes(std::span(values)).data();
}

}  // namespace

void RayCaster::setColors(shared::CastParams& params, std::span<const ColorNode> nodes) {
  if (nodes.empty()) return;
  std::vector<glm::vec4> colors;
  for (const ColorNode& node : nodes) colors.emplace_back(node.color, node.x);
  const auto bytes = std::as_bytes(std::span(colors));
  colorNodes_.reserve(device_, bytes.size(), gpu::MemoryKind::Upload);
  std::memcpy(colorNodes_.mapped().data(), bytes.data(), bytes.size());
  params.colorNodes = colorNodes_.address();
  params.colorNodeCount = static_cast<std::uint32_t>(colors.size());
  params.colorNodeStep = std::bit_floor(params.colorNodeCount - 1);
}

shared::CastParams RayCaster::prepare(const Inputs& inputs) {
  volume_.setTable(inputs.table, slabLength(inputs.lattice, inputs.table));
  shared::CastParams params = gpu::castGeometry(inputs.scene, inputs.view, inputs.lattice);
  params.bricks = volume_.bricks();
  params.nodes = volume_.nodes();
  const SlabTable& slabs = volume_.slabTable();
  params.slabBelow = slabs.below;
  params.slabAbove = slabs.above;
  params.perSlabTexels = 1.0F / glm::vec2(volume_.slabs().extent());
  params.lastPosition = static_cast<float>(slabs.positions - 1);
  params.squarePerPosition = static_cast<float>(shared::slabStripStep) / params.lastPosition;
  params.stripRows = static_cast<float>(slabs.stripRows());
  params.pieces = volume_.tablePieces();
  params.pieceStarts = volume_.pieceStarts();
  params.pieceCount = volume_.pieceCount();
  params.slabLength = slabs.length;
  params.slabsPerDepth = static_cast<float>(1.0 / (inputs.table.unitDistance * slabs.length));
  setRegion(params, inputs.settings.region, inputs.scene);
  setLights(params, inputs.settings.shading, inputs.view);
  setBlending(params, inputs.settings.blending, inputs.table);
  setColors(params, inputs.colorNodes);
  params.takesNearest = inputs.settings.interpolation == Interpolation::Nearest ? 1U : 0U;
  params.cells = volume_.cells();
  params.ranges = volume_.cellRanges();
  params.nodeCount = volume_.nodeCount();
  params.terminationOpticalDepth = terminationOpticalDepth(inputs.settings);
  params.budget = inputs.settings.supersegments;
  params.maxPerList = maxPerList(inputs.settings.supersegments, inputs.settings.budget);
  params.level = -1.0F;
  params.form = storedForm(inputs.form);
  if (!volume_.empty()) pass_.bind(volume_);
  return params;
}

/// The number of bands. On a GPU it is one: the last rays of each band take a millisecond that no other work
/// fills, which is more than the next band hides. On a CPU device it is eight, so that progress shows and an
/// abort takes effect.
std::uint32_t RayCaster::bandsWanted() const {
  constexpr std::uint32_t ofCpu = 8;
  constexpr std::uint32_t ofGpu = 1;
  if (bands_ > 0) return bands_;
  return device_->isCpu() ? ofCpu : ofGpu;
}

/// The number of rows in a band: as many as memory allows, up to a share of the picture. It is a multiple of
/// shared::countedStride, or all rows.
std::uint32_t RayCaster::rowsPerBand(const Inputs& inputs, std::uint64_t bytesPerPixel,
                                     std::uint32_t bands) const {
  const auto height = static_cast<std::uint64_t>(inputs.view.height());
  const std::uint64_t rowBytes = static_cast<std::uint64_t>(inputs.view.width()) * bytesPerPixel;
  // Volumes beyond half of the device's memory leave less for lists, pre-segments and other frames.
  const std::uint64_t memory = device_->limits().memoryBytes;
  const std::uint64_t left = memory - std::min(memory, volume_.texelBytesHeld());
  const std::uint64_t room = std::max(std::min(memory / 8, left / 4), rowBytes);
  // Every device allows 65535 workgroups; each has 64 invocations, and a list takes one or more of them.
  constexpr std::uint64_t maxLists = std::uint64_t{64} * 65535;
  const std::uint64_t stride = shared::countedStride;
  const std::uint64_t most = maxLists / static_cast<std::uint64_t>(inputs.view.width()) / stride * stride;
  std::uint64_t rows = std::min({height, room / rowBytes, most});
  rows = std::min(rows, std::max<std::uint64_t>((height + bands - 1) / bands, 1));
  rows = (rows + shared::countedStride - 1) / shared::countedStride * shared::countedStride;
  return static_cast<std::uint32_t>(std::min(height, rows));
}

/// The level of the counted lists of the whole picture, which its bands must share.
float RayCaster::levelOfNeed(shared::CastParams params, const Inputs& inputs) {
  const auto width = static_cast<std::uint32_t>(inputs.view.width());
  const auto height = static_cast<std::uint32_t>(inputs.view.height());
  const SupersegmentHistogram histogram =
      histogram_.take(commands_, [&](gpu::Commands& commands, std::uint64_t address) {
        params.histogram = address;
        pass_.record(commands, params, gpu::CastPass::Work::Histogram, Algorithm::Merge,
                     {width, 0, height, params.countedStride, false, params.form});
      });
  const double milliseconds = commands_.stageTimes().front().milliseconds;
  times_ += {milliseconds, milliseconds, 0.0};
  return histogram.levelFor(inputs.settings.fill);
}

RayCaster::Cast RayCaster::begin(const Inputs& inputs) {
  Cast cast;
  times_ = {};
  assert(started_ == finished_);
  started_ = finished_ = 0;  // frames of one band use one builder's memory
  cast.height = static_cast<std::uint32_t>(inputs.view.height());
  cast.cutAtGaps = inputs.cutAtGaps;
  cast.isEmpty = volume_.empty() || inputs.lattice.count == 0;
  if (!cast.isEmpty) cast.params = prepare(inputs);
  const std::uint32_t maxCount = maxPerList(inputs.settings.supersegments, inputs.settings.budget);
  ListBuilder::Options& build = cast.build;
  build.width = static_cast<std::uint32_t>(inputs.view.width());
  build.runsOnly = inputs.runsOnly;
  build.algorithm = inputs.runsOnly ? Algorithm::Merge : inputs.settings.algorithm;
  // With cuts at gaps, each list's runs must be counted, unless ranks agree on their counts.
  cast.agreed = inputs.cutAtGaps && build.algorithm == Algorithm::Merge && !inputs.runsOnly;
  build.countedStride =
      build.algorithm == Algorithm::Bisection && inputs.cutAtGaps ? 1 : shared::countedStride;
  build.maxPerList = {inputs.runsOnly ? 1 : maxCount, !inputs.cutAtGaps};
  build.sampleStep = inputs.lattice.step;
  build.form = inputs.form;
  cast.rowsPerBand = rowsPerBand(inputs, ListBuilder::bytesPerList(maxCount, build.algorithm), bandsWanted());
  cast.params.countedStride = build.countedStride;
  cast.params.countedSamples =
      build.countedStride > 1 ? shared::countedSamplesFor(inputs.lattice.count, inputs.settings.supersegments)
                              : 1;
  // A list's need is known only when all ranks' parts of it are together: until then, parts get N_S each.
  if (inputs.settings.budget == Budget::Total && !inputs.cutAtGaps && !cast.isEmpty) {
    cast.params.level = levelOfNeed(cast.params, inputs);
  }
  return cast;
}

namespace {

/// Shift that fits counts into a byte while overflow stays detectable.
std::uint32_t levelShiftFor(std::uint32_t budget) {
  std::uint32_t shift = 0;
  while ((shared::preSegmentsPerBudget * budget >> shift) >= 255) ++shift;
  return shift;
}

}  // namespace

std::uint64_t RayCaster::levelBytes(const Cast& cast) {
  return std::uint64_t{cast.build.countedWidth()} * gpu::groupsFor(cast.height, cast.build.countedStride) *
         shared::countedLevelWords * sizeof(std::uint32_t);
}

void RayCaster::countLevels(Cast& cast, HostAccess& memory, std::uint64_t at) {
  const std::uint64_t bytes = levelBytes(cast);
  levels_.reserve(device_, bytes, gpu::MemoryKind::DeviceLocal);
  cast.params.levels = levels_.address();
  cast.params.levelShift = levelShiftFor(cast.build.maxPerList.supersegments);
  cast.params.countedWidth = cast.build.countedWidth();
  commands_.begin();
  if (cast.isEmpty) {
    commands_.fill(levels_, 0);
  } else {
    commands_.mark("count");
    pass_.record(commands_, cast.params, gpu::CastPass::Work::CountLevels, Algorithm::Merge,
                 {cast.build.width, 0, cast.height, cast.build.countedStride, true, cast.params.form});
  }
  commands_.barrier();
  commands_.mark("download");
  memory.recordWrite(commands_, levels_, 0, at, bytes);
  commands_.submitAndWait();
  memory.finish();
  if (!cast.isEmpty) {
    const double milliseconds = commands_.stageTimes().front().milliseconds;
    times_ += {milliseconds, milliseconds, 0.0};
  }
}

void RayCaster::takeLevelSum(Cast& cast, std::span<const LevelSum> sum) {
  const std::uint32_t width = cast.build.countedWidth();
  const std::uint32_t rows = gpu::groupsFor(cast.height, cast.build.countedStride);
  const std::uint64_t words = std::uint64_t{width} * rows * sizeof(std::uint32_t);
  levelsSum_.reserve(device_, levelBytes(cast), gpu::MemoryKind::DeviceLocal);
  agreedTolerances_.reserve(device_, words, gpu::MemoryKind::DeviceLocal);
  agreedPreSegments_.reserve(device_, words, gpu::MemoryKind::DeviceLocal);
  agreedQuotas_.reserve(device_, words, gpu::MemoryKind::DeviceLocal);
  weights_.reserve(device_, rows * sizeof(std::uint32_t), gpu::MemoryKind::DeviceLocal);
  weightsReadback_.reserve(device_, rows * sizeof(std::uint32_t), gpu::MemoryKind::Readback);
  shared::QuotaConstants quota{};
  quota.own = levels_.address();
  quota.sum = levelsSum_.address();
  quota.tolerances = agreedTolerances_.address();
  quota.preSegments = agreedPreSegments_.address();
  quota.quotas = agreedQuotas_.address();
  quota.weights = weights_.address();
  quota.width = width;
  quota.rows = rows;
  quota.budget = cast.build.maxPerList.supersegments;
  quota.levelShift = cast.params.levelShift;
  quota.levelCount = SupersegmentHistogram::levels - 2;
  sumsOnHost_.clear();
  commands_.begin();
  for (const LevelSum& stretch : sum) {
    stretch.memory->recordRead(commands_, stretch.at, levelsSum_, stretch.first, stretch.bytes);
    sumsOnHost_.push_back(stretch.memory);
  }
  commands_.fill(weights_, 0);
  commands_.barrier();
  commands_.dispatch(quota_, quota, gpu::groupsFor(quota.width, shared::quotaGroup), quota.rows);
  commands_.barrier();
  commands_.copy(weights_, 0, weightsReadback_, 0, rows * sizeof(std::uint32_t));
  commands_.submit();
}

std::vector<std::uint32_t> RayCaster::agreedWeights(const Cast& cast) {
  commands_.wait();
  for (HostAccess* memory : sumsOnHost_) memory->finish();
  const std::uint32_t rows = gpu::groupsFor(cast.height, cast.build.countedStride);
  const auto weights = weightsReadback_.mappedAs<std::uint32_t>().first(rows);
  std::vector<std::uint32_t> result(weights.begin(), weights.end());
  // Each counted list represents a square of lists.
  for (std::uint32_t& weight : result) weight *= cast.build.countedStride * cast.build.countedStride;
  return result;
}

void RayCaster::startBand(Cast& cast, std::uint32_t firstRow, std::uint32_t lastRow, DeviceLists& lists,
                          const ListBuilder::Behind& behind, const gpu::Submission& after) {
  assert(started_ - finished_ < bandsAtOnce);
  ListBuilder& builder = builders_[started_ % bandsAtOnce];
  ListBuilder::Options build = cast.build;
  build.rows = lastRow - firstRow;
  build.rowBehind = lastRow < cast.height;
  if (cast.isEmpty) {
    builder.startEmpty(build.listCount(), lists, behind);
    ++started_;
    return;
  }
  if (cast.agreed) {
    const std::uint64_t first =
        std::uint64_t{firstRow / build.countedStride} * build.countedWidth() * sizeof(std::uint32_t);
    build.agreed = {agreedTolerances_.address() + first, agreedPreSegments_.address() + first,
                    agreedQuotas_.address() + first, build.maxPerList.supersegments};
  }
  const auto record = [this, &cast, build, firstRow, lastRow](gpu::Commands& commands,
                                                              const BandTargets& targets, bool write) {
    // The shader counts lists from the picture's first one; the targets hold only this band's lists.
    const std::uint64_t skipped = std::uint64_t{firstRow} * build.width * sizeof(std::uint32_t);
    gpu::shared::CastParams params = cast.params;
    params.countedWidth = build.countedWidth();
    params.thresholds = targets.thresholds - skipped;
    params.capacities = targets.capacities - skipped;
    params.offsets = targets.offsets - skipped;
    params.segments = targets.segments;
    params.preSegments = targets.preSegments;
    params.written = targets.written - skipped;
    params.left = targets.left - skipped;
    params.quotas = targets.quotas - skipped;
    params.status = targets.status;
    params.guard = targets.guard;
    if (!write && build.algorithm == Algorithm::Merge) {
      params.thresholds = targets.thresholds;
      params.capacities = targets.capacities;
    }
    using Work = gpu::CastPass::Work;
    pass_.record(commands, params, write ? Work::Write : Work::Count, build.algorithm,
                 {build.width, firstRow, lastRow, build.countedStride, cast.cutAtGaps, params.form});
  };
  builder.start(build, record, lists, behind, after);
  ++started_;
}

void RayCaster::finishBand() {
  assert(finished_ < started_);
  ListBuilder& builder = builders_[finished_++ % bandsAtOnce];
  builder.finish();
  times_ += builder.times();
}

void RayCaster::drop() {
  for (ListBuilder& builder : builders_) builder.drop();
  commands_.drop();
  finished_ = started_;
}

/// Casts the volume band after band, and brings each band's values of the arrays to the host.
void RayCaster::castPixels(const Inputs& inputs, const Progress& progress, HostPool& pool,
                           std::span<const PixelArray> arrays) {
  const auto width = static_cast<std::uint32_t>(inputs.view.width());
  const auto height = static_cast<std::uint32_t>(inputs.view.height());
  shared::CastParams params = prepare(inputs);
  std::uint64_t bytesPerPixel = 0;
  for (const PixelArray& array : arrays) bytesPerPixel += array.bytes;
  const std::uint32_t band = rowsPerBand(inputs, bytesPerPixel, bandsWanted());
  for (std::uint32_t row = 0; row < height; row += band) {
    const std::uint32_t end = std::min(height, row + band);
    const std::uint64_t first = std::uint64_t{row} * width;
    const std::uint64_t pixels = std::uint64_t{end - row} * width;
    for (const PixelArray& array : arrays) {
      array.buffer.reserve(device_, pixels * array.bytes, gpu::MemoryKind::DeviceLocal);
      params.*array.address = array.buffer.address() - first * array.bytes;
    }
    commands_.begin();
    commands_.mark("cast");
    pass_.record(commands_, params, gpu::CastPass::Work::Volume, Algorithm::Merge, {width, row, end});
    commands_.barrier();
    commands_.mark("download");
    std::vector<HostAccess*> written;
    for (const PixelArray& array : arrays) {
      const HostPool::Place place = pool.placeOf(array.host + first * array.bytes);
      place.access->recordWrite(commands_, array.buffer, 0, place.at, pixels * array.bytes);
      written.push_back(place.access);
    }
    commands_.submitAndWait();
    for (HostAccess* access : written) access->finish();
    times_.all += commands_.stageTimes().front().milliseconds;
    if (!progress(static_cast<double>(end) / height)) break;
  }
}

void RayCaster::render(const Inputs& inputs, const Progress& progress, HostPool& pool, Image& image) {
  times_ = {};
  if (volume_.empty() || inputs.lattice.count == 0) {
    std::ranges::fill(image.rgba, glm::vec4(0.0F));
    std::ranges::fill(image.depth, Image::noDepth);
    return;
  }
  const std::array arrays{
      PixelArray{colors_, bytesOf(image.rgba), sizeof(glm::vec4), &shared::CastParams::colors},
      PixelArray{depths_, bytesOf(image.depth), sizeof(float), &shared::CastParams::depths}};
  castPixels(inputs, progress, pool, arrays);
}

void RayCaster::project(const Inputs& inputs, const Progress& progress, HostPool& pool,
                        HostVector<std::uint64_t>& keys) {
  times_ = {};
  if (volume_.empty() || inputs.lattice.count == 0) {
    std::ranges::fill(keys, 0);
    return;
  }
  const std::array arrays{
      PixelArray{extremes_, bytesOf(keys), sizeof(std::uint64_t), &shared::CastParams::extremes}};
  castPixels(inputs, progress, pool, arrays);
}

}  // namespace vdi::detail
