#include "vdi/pipeline/RayCaster.h"

#include <algorithm>

namespace vdi::detail {

namespace shared = gpu::shared;

RayCaster::RayCaster(std::shared_ptr<gpu::Device> device)
    : device_(std::move(device)),
      volume_(device_),
      pass_(device_),
      builder_(device_),
      commands_(device_),
      survey_(device_) {}

shared::CastParams RayCaster::prepare(const Request& request) {
  volume_.setTable(request.table, slabLength(request.lattice, request.table));
  shared::CastParams params = gpu::castGeometry(request.scene, request.view, request.lattice);
  params.bricks = volume_.bricks();
  params.nodes = volume_.nodes();
  const SlabTable& slabs = volume_.slabTable();
  params.slabBelow = slabs.below;
  params.slabAbove = slabs.above;
  params.perSlabTexels = 1.0F / glm::vec2(volume_.slabs().extent());
  params.lastPosition = static_cast<float>(slabs.positions - 1);
  params.squarePerPosition = static_cast<float>(shared::slabStripStep) / params.lastPosition;
  params.stripRows = static_cast<float>(slabs.stripRows());
  params.slabsPerDepth = static_cast<float>(1.0 / (request.table.unitDistance * slabs.length));
  params.cells = volume_.cells();
  params.nodeCount = volume_.nodeCount();
  params.enough = terminationOpticalDepth(request.settings);
  params.budget = request.settings.supersegments;
  params.mostPerList = mostPerList(request.settings.supersegments, request.settings.budget);
  params.level = -1.0F;
  params.runsOnly = request.runsOnly ? 1U : 0U;
  params.form = storedForm(request.code);
  if (!volume_.empty()) pass_.bind(volume_);
  return params;
}

/// The whole picture at once where memory allows; on a CPU device in eighths, so that progress shows and an
/// abort is heard. A multiple of shared::countedStride, or all.
std::uint32_t RayCaster::rowsPerBand(const Request& request, std::uint64_t bytesPerPixel) const {
  const auto height = static_cast<std::uint64_t>(request.view.height());
  const std::uint64_t rowBytes = static_cast<std::uint64_t>(request.view.width()) * bytesPerPixel;
  const std::uint64_t room = std::max<std::uint64_t>(device_->limits().memoryBytes / 8, rowBytes);
  std::uint64_t rows = std::min(height, room / rowBytes);
  if (device_->isCpu()) rows = std::min(rows, std::max<std::uint64_t>((height + 7) / 8, 1));
  rows = (rows + shared::countedStride - 1) / shared::countedStride * shared::countedStride;
  return static_cast<std::uint32_t>(std::min(height, rows));
}

/// Of the lists that are counted, in the whole picture: bands of it must agree.
float RayCaster::levelOfNeed(shared::CastParams params, const Request& request) {
  const auto width = static_cast<std::uint32_t>(request.view.width());
  const auto height = static_cast<std::uint32_t>(request.view.height());
  const Survey survey = survey_.take(commands_, [&](gpu::Commands& commands, std::uint64_t address) {
    params.survey = address;
    pass_.record(commands, params, gpu::CastPass::Work::Survey, Algorithm::Merge,
                 {width, 0, height, params.countedStride, false, params.form});
  });
  const double milliseconds = commands_.stageTimes().front().milliseconds;
  times_ += {milliseconds, milliseconds, 0.0};
  return survey.levelFor(request.settings.fill);
}

template <typename Segment>
ListsOf<Segment> RayCaster::lists(const Request& request, const Progress& progress, ListsOf<Segment> result) {
  const auto width = static_cast<std::uint32_t>(request.view.width());
  const auto height = static_cast<std::uint32_t>(request.view.height());
  result.offsets.assign(1, 0);
  const bool nothingThere = volume_.empty() || request.lattice.count == 0;
  if (nothingThere) {
    result.offsets.assign(static_cast<std::size_t>(width) * height + 1, 0);
    result.segments.clear();
    return result;
  }
  result.offsets.reserve(static_cast<std::size_t>(width) * height + 1);
  shared::CastParams params = prepare(request);
  // What has no budget needs no merging: one try with the coarsest sensitivity does.
  const Algorithm algorithm = request.runsOnly ? Algorithm::Bisection : request.settings.algorithm;
  const std::uint32_t band = rowsPerBand(request, ListBuilder::bytesPerList(params.mostPerList, algorithm));
  // With cuts at gaps each list's runs must be counted.
  const std::uint32_t stride = request.cutAtGaps ? 1 : shared::countedStride;
  params.countedStride = stride;
  params.countedSamples =
      stride > 1 ? shared::countedSamplesFor(request.lattice.count, request.settings.supersegments) : 1;
  times_ = {};
  // What a list needs is known when all ranks' parts of it are together: parts have N_S each.
  if (request.settings.budget == Budget::Total && !request.cutAtGaps) {
    params.level = levelOfNeed(params, request);
  }
  for (std::uint32_t row = 0; row < height; row += band) {
    const std::uint32_t end = std::min(height, row + band);
    ListBuilder::Request build;
    build.width = width;
    build.rows = end - row;
    build.rowBehind = end < height;
    build.countedStride = stride;
    build.algorithm = algorithm;
    build.most = {params.mostPerList, !request.cutAtGaps};
    build.sampleStep = request.lattice.step;
    build.code = request.code;
    params.countedWidth = build.countedWidth();
    const auto record = [&](gpu::Commands& commands, const BandTargets& targets, bool write) {
      // The shader counts lists from the picture's first; the targets hold just this band's.
      const std::uint64_t skipped = std::uint64_t{row} * width * sizeof(std::uint32_t);
      params.sensitivities = targets.sensitivities - skipped;
      params.counts = targets.counts - skipped;
      params.offsets = targets.offsets - skipped;
      params.segments = targets.segments;
      params.grains = targets.grains;
      params.written = targets.written - skipped;
      params.left = targets.left - skipped;
      params.status = targets.status;
      if (!write && algorithm == Algorithm::Merge) {
        params.sensitivities = targets.sensitivities;
        params.counts = targets.counts;
      }
      using Work = gpu::CastPass::Work;
      pass_.record(commands, params, write ? Work::Write : Work::Search, algorithm,
                   {width, row, end, stride, request.cutAtGaps, params.form});
    };
    builder_.build(build, record, result);
    times_ += builder_.times();
    if (!progress(static_cast<double>(end) / height)) break;
  }
  result.segments.resize(result.offsets.back());
  return result;
}

template SupersegmentLists RayCaster::lists(const Request&, const Progress&, SupersegmentLists);
template CompactLists RayCaster::lists(const Request&, const Progress&, CompactLists);

Image RayCaster::image(const Request& request, const Progress& progress, Image image) {
  const auto width = static_cast<std::uint32_t>(request.view.width());
  const auto height = static_cast<std::uint32_t>(request.view.height());
  image.width = request.view.width();
  image.height = request.view.height();
  if (volume_.empty() || request.lattice.count == 0) {
    image.rgba.assign(image.pixelCount(), glm::vec4(0.0F));
    image.depth.assign(image.pixelCount(), Image::noDepth);
    return image;
  }
  image.rgba.reserve(image.pixelCount());
  image.depth.reserve(image.pixelCount());
  shared::CastParams params = prepare(request);
  const std::uint32_t band = rowsPerBand(request, sizeof(glm::vec4) + sizeof(float));
  times_ = {};
  for (std::uint32_t row = 0; row < height; row += band) {
    const std::uint32_t end = std::min(height, row + band);
    const std::uint64_t first = std::uint64_t{row} * width;
    picture_.reserve(device_, std::uint64_t{end - row} * width);
    params.colors = picture_.colors() - first * sizeof(glm::vec4);
    params.depths = picture_.depths() - first * sizeof(float);
    commands_.begin();
    commands_.mark("cast");
    pass_.record(commands_, params, gpu::CastPass::Work::Volume, Algorithm::Merge, {width, row, end});
    picture_.recordDownload(commands_);
    commands_.submitAndWait();
    times_.all += commands_.stageTimes().front().milliseconds;
    picture_.copyTo(image, first);
    if (!progress(static_cast<double>(end) / height)) break;
  }
  image.rgba.resize(image.pixelCount(), glm::vec4(0.0F));
  image.depth.resize(image.pixelCount(), Image::noDepth);
  return image;
}

}  // namespace vdi::detail
