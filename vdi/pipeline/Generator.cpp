// VdiGenerator: the four stages in order, and who waits for whom.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>

#include "vdi/comm/ByteSum.h"
#include "vdi/comm/Exchange.h"
#include "vdi/comm/GhostExchange.h"
#include "vdi/comm/GlobalScene.h"
#include "vdi/comm/Ownership.h"
#include "vdi/core/Error.h"
#include "vdi/pipeline/Compositor.h"
#include "vdi/pipeline/Distributor.h"
#include "vdi/pipeline/Fingerprint.h"
#include "vdi/pipeline/Gather.h"
#include "vdi/pipeline/Pipeline.h"
#include "vdi/pipeline/RayCaster.h"

namespace vdi {

namespace {

constexpr int root = 0;

/// Seconds since it was made or last asked.
class Stopwatch {
 public:
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - start_).count();
    start_ = now;
    return seconds;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// What's known of a time step's blocks.
struct Step {
  Scene scene;  // global
  std::uint64_t blocks = 0;
  std::uint64_t bytes = 0;
  double uploadSeconds = 0.0;
  bool doubles = false;  // some of this rank's are f64
};

/// Collective. Where no rank has anything but zeros and values that are lost, nothing would be seen.
void requireUsableValues(const comm::Communicator& comm, std::span<const Block> blocks) {
  const ValueSizes own = valueSizesOf(blocks);
  std::array<std::uint64_t, 2> any{own.usable ? 1U : 0U, own.tooSmall ? 1U : 0U};
  comm.allReduceMax(any);
  if (any[0] != 0 || any[1] == 0) return;
  throw Error(
      ErrorCode::InvalidArgument,
      fmt::format("all values are 0 or smaller than {} (f32) or {} (f64) in size, too small to be told "
                  "apart; other units help",
                  limitsOf(ScalarType::F32).minimum, limitsOf(ScalarType::F64).minimum));
}

}  // namespace

struct VdiGenerator::State {
  State(std::shared_ptr<gpu::Device> theDevice, comm::Communicator theComm)
      : device(std::move(theDevice)), comm(std::move(theComm)) {
    comm.together([&] {
      const comm::Transport transport = comm::transportFromEnvironment();
      const bool shares = comm.size() > 1 && transport == comm::Transport::Shared;
      using Visible = detail::HostPool::Visible;
      pool = std::make_shared<detail::HostPool>(device, shares ? Visible::ToHost : Visible::ToProcess);
      caster = std::make_unique<detail::RayCaster>(device);
      compositor = std::make_unique<detail::Compositor>(device);
      distributor = std::make_unique<detail::Distributor>(device, comm, transport);
      gather = std::make_unique<detail::Gather>(device, comm, transport, root);
      scan = std::make_unique<gpu::ScanPass>(device);
      levelSum = std::make_unique<comm::ByteSum>(comm, transport);
      accesses = std::make_unique<detail::HostAccesses>(device);
    });
  }
  ~State() {
    if (pool) pool->detach();  // VDIs may outlive this
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  State(State&&) = delete;
  State& operator=(State&&) = delete;

  std::shared_ptr<gpu::Device> device;
  comm::Communicator comm;
  std::shared_ptr<detail::HostPool> pool;  // of VDIs and pictures
  std::unique_ptr<detail::RayCaster> caster;
  std::unique_ptr<detail::Compositor> compositor;
  std::unique_ptr<detail::Distributor> distributor;
  std::unique_ptr<detail::Gather> gather;
  std::unique_ptr<gpu::ScanPass> scan;
  std::unique_ptr<comm::ByteSum> levelSum;
  std::unique_ptr<detail::HostAccesses> accesses;  // to the memory of levelSum
  detail::DeviceLists band;                        // of this rank's own lists
  /// Of the lists that this rank owns, by band.
  struct OwnedBand {
    comm::Ownership owned;
    std::uint64_t firstList = 0;
    detail::Compositor::Interleaved interleaved;
    detail::DeviceLists lists;
    gpu::Buffer colors;
    gpu::Buffer depths;
  };
  std::vector<OwnedBand> bands;
  Step shown;
  ScalarRange range;  // of what's shown, global
  std::optional<Step> next;
  RankReport mine;
  std::vector<RankReport> reports;

  /// By one of VolumeStore's ways.
  Step sendBlocks(std::vector<Block> blocks, bool fillGhosts,
                  void (gpu::VolumeStore::*send)(std::span<const Block>, const Scene&)) {
    Stopwatch watch;
    Step step;
    comm.together([&] { validate(blocks); });
    requireUsableValues(comm, blocks);
    for (const Block& block : blocks) {
      step.bytes += block.byteCount();
      step.doubles = step.doubles || block.type == ScalarType::F64;
    }
    step.blocks = blocks.size();
    blocks = fillGhosts ? comm::exchangeGhosts(comm, std::move(blocks))
                        : comm::settleOwnership(comm, std::move(blocks));
    step.scene = comm::globalScene(comm, localScene(blocks));
    comm.together([&] { (caster->volume().*send)(blocks, step.scene); });
    step.uploadSeconds = watch.lap();
    return step;
  }

  /// What's there now.
  void show(const Step& step) {
    shown = step;
    const ScalarRange& own = caster->volume().valueRange();
    std::array<double, 2> minimum{own.min, -own.max};
    comm.allReduceMin(minimum);
    range = {minimum[0], -minimum[1]};
  }

  void dropNext() {
    next.reset();
    caster->volume().dropNext();
  }

  /// What generate and renderVolume have in common: checked parameters and this rank's lists.
  struct Prepared {
    View view;
    DepthLattice lattice;
    TransferTable table;
  };

  /// Of f64 there are floats on the device that say where in the block's range a value lies.
  void requireSpans(const TransferTable& table) const {
    constexpr double maxCount = 1e33;
    const double span = range.max - range.min;
    if (!shown.doubles || !(span > maxCount * (table.max - table.min))) return;
    throw Error(
        ErrorCode::InvalidArgument,
        fmt::format("the values are from {} to {}, the transfer function's from {} to {}: more than a "
                    "factor of {}; missing values as NaN rather than a large number help",
                    range.min, range.max, table.min, table.max, maxCount));
  }

  std::unique_ptr<Prepared> prepare(const Camera& camera, const TransferFunction& function,
                                    const GenerateSettings& settings) {
    std::unique_ptr<Prepared> prepared;
    comm.together([&] {
      validate(settings);
      const View view(camera, settings.width, settings.height);
      prepared = std::make_unique<Prepared>(
          Prepared{view, depthLattice(shown.scene, view, settings.samplesPerVoxel), bake(function)});
      requireSpans(prepared->table);
    });
    const std::array prints{
        comm::Communicator::Fingerprint{detail::fingerprintOf(camera), "camera"},
        comm::Communicator::Fingerprint{detail::fingerprintOf(function), "transfer function"},
        comm::Communicator::Fingerprint{
            detail::fingerprintOf(settings),
            "resolution, supersegments, budget, sampling rate, algorithm or precision"}};
    comm.requireEqual(prints);
    mine = {};
    mine.uploadSeconds = std::exchange(shown.uploadSeconds, 0.0);
    mine.blocks = shown.blocks;
    mine.volumeBytes = shown.bytes;
    return prepared;
  }

  /// Runs a stage that asks for progress; all ranks throw Cancelled together if any was told to stop.
  template <typename Work>
  void cancellable(const Progress& progress, double share, Work work) {
    bool cancelled = false;
    comm.together([&] {
      work([&](double done) {
        if (progress && !progress(done * share)) cancelled = true;
        return !cancelled;
      });
    });
    std::array<std::uint64_t, 1> any{cancelled ? 1U : 0U};
    comm.allReduceMax(any);
    if (any[0] != 0) throw Error(ErrorCode::Cancelled, "stopped on request");
  }

  detail::RayCaster::Request requestOf(const Prepared& prepared, const GenerateSettings& settings,
                                       bool runsOnly, const DepthCode& code) const {
    return {shown.scene, prepared.view,   prepared.lattice, prepared.table,
            settings,    comm.size() > 1, runsOnly,         code};
  }

  /// The VDI's lists; what it is that's sent and stored, Segment says. With one rank.
  template <typename Segment>
  ListsOf<Segment> makeListsAlone(const Prepared& prepared, const GenerateSettings& settings,
                                  const DepthCode& code, const Progress& progress) {
    Stopwatch watch;
    auto lists = detail::listsIn<Segment>(pool);
    detail::ListDownload<Segment> download(lists, *pool);
    cancellable(progress, 0.95, [&](const detail::RayCaster::Progress& report) {
      detail::RayCaster::Cast cast = caster->begin(requestOf(prepared, settings, false, code));
      lists.offsets.reserve(std::uint64_t{cast.build.width} * cast.height + 1);
      for (std::uint32_t row = 0; row < cast.height; row += cast.rowsPerBand) {
        const std::uint32_t end = std::min(cast.height, row + cast.rowsPerBand);
        caster->makeBand(cast, row, end, band,
                         [&](gpu::Commands& commands) { download.record(commands, *scan, band); });
        download.finish();
        if (!report(static_cast<double>(end) / cast.height)) break;
      }
    });
    mine.subSupersegments = lists.segments.size();
    mine.generateSeconds = watch.lap();
    noteTimes();
    return lists;
  }

  /// Collective: one tolerance for what all ranks have in a list.
  void agreeOnLists(detail::RayCaster::Cast& cast) {
    if (!cast.agreed) return;
    const comm::Exchange::Place own = levelSum->begin(detail::RayCaster::levelBytes(cast));
    comm.together([&] {
      accesses->tidy();
      caster->countLevels(cast, accesses->of(own.memory), own.at);
    });
    std::vector<detail::RayCaster::LevelSum> sum;
    for (const comm::ByteSum::Stretch& stretch : levelSum->add()) {
      sum.push_back({&accesses->of(stretch.place.memory), stretch.place.at, stretch.first, stretch.bytes});
    }
    comm.together([&] { caster->agree(cast, sum); });
  }

  /// Who owns which of the picture's lists: the same on all ranks.
  comm::Ownership ownershipOf(const detail::RayCaster::Cast& cast) {
    const std::uint64_t width = cast.build.width;
    const std::uint64_t lists = width * cast.height;
    if (!cast.agreed) return comm::Ownership::equal(lists, comm.size());
    return comm::Ownership::balanced(lists, comm.size(), caster->agreedWeights(cast),
                                     width * cast.build.countedStride);
  }

  /// Collective: this rank's lists, band after band, to those who own them, where they're merged by depth.
  void makeOwnedBands(const Prepared& prepared, const GenerateSettings& settings, bool runsOnly,
                      const DepthCode& code, const Progress& progress) {
    Stopwatch watch;
    detail::RayCaster::Cast cast;
    comm.together([&] { cast = caster->begin(requestOf(prepared, settings, runsOnly, code)); });
    std::array<double, 1> rows{static_cast<double>(cast.rowsPerBand)};
    comm.allReduceMin(rows);  // all ranks' bands are the same
    const auto rowsPerBand = static_cast<std::uint32_t>(rows[0]);
    const std::uint64_t width = cast.build.width;
    agreeOnLists(cast);
    std::optional<comm::Ownership> ownership;
    bands.resize((cast.height + rowsPerBand - 1) / rowsPerBand);
    compositor->takeMilliseconds();
    for (std::size_t i = 0; i < bands.size(); ++i) {
      OwnedBand& own = bands[i];
      const auto row = static_cast<std::uint32_t>(i) * rowsPerBand;
      const std::uint32_t end = std::min(cast.height, row + rowsPerBand);
      own.firstList = row * width;
      cancellable(progress, 0.8, [&](const detail::RayCaster::Progress& report) {
        compositor->wait();  // for the band before, whose lists are in the memory of this one's
        caster->makeBand(cast, row, end, band);
        if (!ownership) ownership = ownershipOf(cast);
        report(static_cast<double>(end) / cast.height);
      });
      own.owned = ownership->within(row * width, end * width);
      mine.subSupersegments += band.count;
      mine.generateSeconds += watch.lap();
      const detail::Distributed parts = distributor->distribute(band, own.owned, detail::segmentBytes(code));
      mine.bytesSent += distributor->bytesSent();
      mine.distributeSeconds += watch.lap();
      comm.together([&] { compositor->interleave(parts, code, own.interleaved); });
      mine.compositeSeconds += watch.lap();
    }
    noteTimes();
  }

  /// Collective: the VDI's lists, on the root.
  template <typename Segment>
  ListsOf<Segment> makeLists(const Prepared& prepared, const GenerateSettings& settings,
                             const DepthCode& code, const Progress& progress) {
    if (comm.size() == 1) return makeListsAlone<Segment>(prepared, settings, code, progress);
    makeOwnedBands(prepared, settings, false, code, progress);
    Stopwatch watch;
    detail::Compositor::Request request{settings.supersegments,
                                        maxPerList(settings.supersegments, settings.budget),
                                        prepared.lattice.step,
                                        settings.algorithm,
                                        code,
                                        -1.0F};
    if (settings.budget == Budget::Total) {
      SupersegmentHistogram histogram;
      comm.together([&] {
        for (const OwnedBand& own : bands) histogram += compositor->histogram(own.interleaved, request);
      });
      comm.allReduceSum(histogram.supersegments);
      comm.allReduceSum(std::span(&histogram.equally, 1));
      request.level = histogram.levelFor(settings.fill);
    }
    cancellable(progress, 0.95, [&](const detail::RayCaster::Progress& report) {
      for (OwnedBand& own : bands) compositor->composite(own.interleaved, request, own.lists);
      report(1.0);
    });
    mine.compositeDeviceSeconds = 1e-3 * compositor->takeMilliseconds();
    mine.compositeSeconds += watch.lap();
    ListsOf<Segment> lists = gatherLists<Segment>(settings);
    mine.gatherSeconds = watch.lap();
    return lists;
  }

  /// Collective. Where a rank's lists of a band begin among all: supersegments of the bands before, and of
  /// the ranks before in this one. The last one is how many there are.
  std::vector<std::uint64_t> firstSegments() const {
    std::vector<std::uint64_t> counts;
    for (const OwnedBand& own : bands) counts.push_back(own.lists.count);
    const std::vector<std::uint64_t> all = comm.allGatherWords(counts);
    std::vector<std::uint64_t> firsts;
    std::uint64_t before = 0;
    for (std::size_t b = 0; b < bands.size(); ++b) {
      for (int r = 0; r < comm.size(); ++r) {
        if (r == comm.rank()) firsts.push_back(before);
        before += all[static_cast<std::size_t>(r) * bands.size() + b];
      }
    }
    firsts.push_back(before);
    return firsts;
  }

  /// Collective: the owners' lists, on the root.
  template <typename Segment>
  ListsOf<Segment> gatherLists(const GenerateSettings& settings) {
    const std::vector<std::uint64_t> firsts = firstSegments();
    const std::uint64_t total = firsts.back();
    const std::uint64_t listCount =
        static_cast<std::uint64_t>(settings.width) * static_cast<std::uint64_t>(settings.height);
    ListsOf<Segment> lists;
    std::vector<detail::Gather::Piece> pieces;
    comm.together([&] {
      if (total > std::numeric_limits<std::uint32_t>::max()) {
        throw Error(ErrorCode::OutOfMemory, "more than 2^32 supersegments in one VDI");
      }
      if (comm.rank() == root) {
        lists = detail::listsIn<Segment>(pool);
        lists.offsets.resize(listCount + 1);
        lists.offsets[listCount] = static_cast<std::uint32_t>(total);
        lists.segments.reserve(std::max<std::uint64_t>(total, 1));
        lists.segments.resize(total);
      }
      for (std::size_t b = 0; b < bands.size(); ++b) {
        const OwnedBand& own = bands[b];
        const std::uint64_t firstList = own.firstList + own.owned.of(comm.rank()).first;
        pieces.push_back({&own.lists.offsets, 0, firstList * sizeof(std::uint32_t),
                          own.lists.listCount * sizeof(std::uint32_t)});
        pieces.push_back(
            {&own.lists.segments, 1, firsts[b] * sizeof(Segment), own.lists.count * sizeof(Segment)});
      }
    });
    const std::array<void*, 2> arrays{lists.offsets.data(), lists.segments.data()};
    gather->run(*pool, arrays, pieces, [&](gpu::Commands& commands) {
      for (std::size_t b = 0; b < bands.size(); ++b) {
        scan->recordRebase(commands, bands[b].lists.offsets, bands[b].lists.listCount,
                           static_cast<std::uint32_t>(firsts[b]));
      }
    });
    mine.bytesSent += gather->bytesSent();
    return lists;
  }

  /// Collective: the picture of all ranks' volumes, on the root. The limit case of the paper's section 5.3:
  /// one supersegment a run, composited in order of depth.
  Image renderTogether(const Prepared& prepared, const GenerateSettings& settings, const Progress& progress) {
    makeOwnedBands(prepared, settings, true, {}, progress);
    Stopwatch watch;
    Image image;
    std::vector<detail::Gather::Piece> pieces;
    comm.together([&] {
      if (comm.rank() == root) image = imageIn(settings);
      for (OwnedBand& own : bands) {
        compositor->flatten(own.interleaved, {}, own.colors, own.depths);
        const std::uint64_t first = own.firstList + own.owned.of(comm.rank()).first;
        const std::uint64_t count = own.interleaved.listCount;
        pieces.push_back({&own.colors, 0, first * sizeof(glm::vec4), count * sizeof(glm::vec4)});
        pieces.push_back({&own.depths, 1, first * sizeof(float), count * sizeof(float)});
      }
    });
    mine.compositeDeviceSeconds = 1e-3 * compositor->takeMilliseconds();
    mine.compositeSeconds += watch.lap();
    const std::array<void*, 2> arrays{image.rgba.data(), image.depth.data()};
    gather->run(*pool, arrays, pieces, {});
    mine.bytesSent += gather->bytesSent();
    mine.gatherSeconds = watch.lap();
    return image;
  }

  /// Of the settings' size, not cleared.
  Image imageIn(const GenerateSettings& settings) const {
    Image image;
    image.width = settings.width;
    image.height = settings.height;
    image.rgba = HostVector<glm::vec4>(HostAllocator<glm::vec4>(pool));
    image.depth = HostVector<float>(HostAllocator<float>(pool));
    image.rgba.resize(image.pixelCount());
    image.depth.resize(image.pixelCount());
    return image;
  }

  void noteTimes() {
    mine.generateDeviceSeconds = 1e-3 * caster->times().all;
    mine.countSeconds = 1e-3 * caster->times().count;
    mine.writeSeconds = 1e-3 * caster->times().write;
  }

  void shareReports() {
    static_assert(std::is_trivially_copyable_v<RankReport>);
    mine.deviceBytes = device->allocatedBytes();
    const comm::Gathered all = comm.gather(std::as_bytes(std::span(&mine, 1)), sizeof(RankReport), root);
    reports.resize(all.bytes.size() / sizeof(RankReport));
    if (!reports.empty()) std::memcpy(reports.data(), all.bytes.data(), all.bytes.size());
  }
};

VdiGenerator::VdiGenerator(std::shared_ptr<gpu::Device> device, comm::Communicator comm)
    : state_(std::make_unique<State>(std::move(device), std::move(comm))) {}

VdiGenerator::~VdiGenerator() = default;

void VdiGenerator::setBlocks(std::vector<Block> blocks, bool fillGhosts) {
  State& s = *state_;
  s.dropNext();
  s.shown = {};  // where a rank fails, nobody shows anything
  s.range = {};
  s.show(s.sendBlocks(std::move(blocks), fillGhosts, &gpu::VolumeStore::setBlocks));
}

void VdiGenerator::setNextBlocks(std::vector<Block> blocks, bool fillGhosts) {
  State& s = *state_;
  s.dropNext();
  try {
    s.next = s.sendBlocks(std::move(blocks), fillGhosts, &gpu::VolumeStore::setNextBlocks);
  } catch (...) {
    s.dropNext();  // a rank that hasn't failed may have sent its own
    throw;
  }
}

void VdiGenerator::advance() {
  State& s = *state_;
  Stopwatch watch;
  const std::optional<Step> next = std::exchange(s.next, std::nullopt);
  if (!next) throw Error(ErrorCode::InvalidArgument, "no next blocks were set");
  s.comm.together([&] { s.caster->volume().awaitNext(); });
  s.caster->volume().showNext();
  s.show(*next);
  s.shown.uploadSeconds += watch.lap();
}

std::optional<Vdi> VdiGenerator::generate(const Camera& camera, const TransferFunction& transferFunction,
                                          const GenerateSettings& settings, const Progress& progress) {
  State& s = *state_;
  const auto prepared = s.prepare(camera, transferFunction, settings);
  Vdi vdi;
  if (settings.precision == Precision::Compact) vdi.depthCode = depthCodeFor(prepared->lattice);
  if (vdi.depthCode.step > 0.0F) {
    vdi.lists = s.makeLists<CompactSupersegment>(*prepared, settings, vdi.depthCode, progress);
  } else {
    vdi.lists = s.makeLists<Supersegment>(*prepared, settings, {}, progress);
  }
  s.shareReports();
  if (progress) progress(1.0);
  if (s.comm.rank() != root) return std::nullopt;
  vdi.camera = camera;
  vdi.width = settings.width;
  vdi.height = settings.height;
  vdi.budget = maxPerList(settings.supersegments, settings.budget);
  vdi.bounds = s.shown.scene.bounds;
  vdi.sampleStep = prepared->lattice.step;
  return vdi;
}

std::optional<Image> VdiGenerator::renderVolume(const Camera& camera,
                                                const TransferFunction& transferFunction,
                                                const GenerateSettings& settings, const Progress& progress) {
  State& s = *state_;
  const auto prepared = s.prepare(camera, transferFunction, settings);
  Image image;
  if (s.comm.size() > 1) {
    image = s.renderTogether(*prepared, settings, progress);
  } else {
    Stopwatch watch;
    s.cancellable(progress, 0.95, [&](const detail::RayCaster::Progress& report) {
      image = s.imageIn(settings);
      s.caster->render(s.requestOf(*prepared, settings, false, {}), report, *s.pool, image);
    });
    s.mine.generateSeconds = watch.lap();
    s.noteTimes();
  }
  s.shareReports();
  if (progress) progress(1.0);
  if (s.comm.rank() != root) return std::nullopt;
  return image;
}

const Scene& VdiGenerator::scene() const {
  return state_->shown.scene;
}
const ScalarRange& VdiGenerator::scalarRange() const {
  return state_->range;
}
const std::vector<RankReport>& VdiGenerator::reports() const {
  return state_->reports;
}
const gpu::Device& VdiGenerator::device() const {
  return *state_->device;
}
const comm::Communicator& VdiGenerator::communicator() const {
  return state_->comm;
}

}  // namespace vdi
