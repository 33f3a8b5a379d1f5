// VdiGenerator: the four stages in order, and who waits for whom.
#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cstring>
#include <span>
#include <type_traits>
#include <utility>
#include <variant>

#include "vdi/comm/DirectSend.h"
#include "vdi/comm/GhostExchange.h"
#include "vdi/core/Error.h"
#include "vdi/core/Parallel.h"
#include "vdi/pipeline/Compositor.h"
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

/// FNV-1a over the bytes of plain values: equal parameters have equal fingerprints on every rank.
class Fingerprint {
 public:
  template <typename T>
  void add(const T& value) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    std::array<unsigned char, sizeof(T)> bytes{};
    std::memcpy(bytes.data(), &value, sizeof(T));
    for (const unsigned char byte : bytes) hash_ = (hash_ ^ byte) * 0x100000001b3ULL;
  }
  void add(const glm::dvec3& v) {
    for (int axis = 0; axis < 3; ++axis) add(v[axis]);
  }
  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325ULL;
};

std::uint64_t fingerprintOf(const Camera& camera) {
  Fingerprint print;
  print.add(camera.position);
  print.add(camera.focalPoint);
  print.add(camera.viewUp);
  print.add(camera.viewAngle);
  print.add(camera.parallelProjection);
  print.add(camera.parallelScale);
  return print.value();
}

std::uint64_t fingerprintOf(const TransferFunction& function) {
  Fingerprint print;
  for (const ColorNode& node : function.colors) {
    print.add(node.x);
    print.add(node.color);
  }
  for (const OpacityNode& node : function.opacities) {
    print.add(node.x);
    print.add(node.opacity);
  }
  print.add(function.unitDistance);
  return print.value();
}

std::uint64_t fingerprintOf(const GenerateSettings& settings) {
  Fingerprint print;
  print.add(settings.width);
  print.add(settings.height);
  print.add(settings.supersegments);
  print.add(settings.budget);
  print.add(settings.fill);
  print.add(settings.samplesPerVoxel);
  print.add(settings.algorithm);
  print.add(settings.precision);
  print.add(settings.terminationOpacity);
  return print.value();
}

/// What's known of a time step's blocks.
struct Step {
  Scene scene;  // global
  std::uint64_t blocks = 0;
  std::uint64_t bytes = 0;
  double uploadSeconds = 0.0;
  bool doubles = false;  // some of this rank's are f64
};

/// Collective. Where no rank has anything but zeros and values that are lost, nothing would be seen.
void demandUsableValues(const comm::Communicator& comm, std::span<const Block> blocks) {
  const ValueSizes own = valueSizesOf(blocks);
  std::array<std::uint64_t, 2> any{own.usable ? 1U : 0U, own.tooSmall ? 1U : 0U};
  comm.allReduceMax(any);
  if (any[0] != 0 || any[1] == 0) return;
  throw Error(
      ErrorCode::InvalidArgument,
      fmt::format("all values are 0 or smaller than {} (f32) or {} (f64) in size, too small to be told "
                  "apart; other units help",
                  limitsOf(ScalarType::F32).least, limitsOf(ScalarType::F64).least));
}

}  // namespace

struct VdiGenerator::State {
  State(std::shared_ptr<gpu::Device> theDevice, comm::Communicator theComm)
      : device(std::move(theDevice)), comm(std::move(theComm)) {
    comm.together([&] {
      caster = std::make_unique<detail::RayCaster>(device);
      compositor = std::make_unique<detail::Compositor>(device);
    });
  }

  std::shared_ptr<gpu::Device> device;
  comm::Communicator comm;
  std::unique_ptr<detail::RayCaster> caster;
  std::unique_ptr<detail::Compositor> compositor;
  Step shown;
  ScalarRange range;  // of what's shown, global
  std::optional<Step> next;
  std::variant<SupersegmentLists, CompactLists> spare;  // for their memory
  Image spareImage;
  RankReport mine;
  std::vector<RankReport> reports;

  /// By one of VolumeStore's ways.
  Step sendBlocks(std::vector<Block> blocks, bool fillGhosts,
                  void (gpu::VolumeStore::*send)(std::span<const Block>, const Scene&)) {
    Stopwatch watch;
    Step step;
    comm.together([&] { validate(blocks); });
    demandUsableValues(comm, blocks);
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
    std::array<double, 2> least{own.min, -own.max};
    comm.allReduceMin(least);
    range = {least[0], -least[1]};
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
  void demandSpans(const TransferTable& table) const {
    constexpr double most = 1e33;
    const double span = range.max - range.min;
    if (!shown.doubles || !(span > most * (table.max - table.min))) return;
    throw Error(
        ErrorCode::InvalidArgument,
        fmt::format("the values are from {} to {}, the transfer function's from {} to {}: more than a "
                    "factor of {}; missing values as NaN rather than a large number help",
                    range.min, range.max, table.min, table.max, most));
  }

  std::unique_ptr<Prepared> prepare(const Camera& camera, const TransferFunction& function,
                                    const GenerateSettings& settings) {
    std::unique_ptr<Prepared> prepared;
    comm.together([&] {
      validate(settings);
      const View view(camera, settings.width, settings.height);
      prepared = std::make_unique<Prepared>(
          Prepared{view, depthLattice(shown.scene, view, settings.samplesPerVoxel), bake(function)});
      demandSpans(prepared->table);
    });
    comm.demandEqual(fingerprintOf(camera), "camera");
    comm.demandEqual(fingerprintOf(function), "transfer function");
    comm.demandEqual(fingerprintOf(settings),
                     "resolution, supersegments, budget, sampling rate, algorithm or precision");
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

  template <typename Segment>
  ListsOf<Segment> takeSpare() {
    auto* lists = std::get_if<ListsOf<Segment>>(&spare);
    return lists != nullptr ? std::exchange(*lists, {}) : ListsOf<Segment>();
  }

  /// The VDI's lists, on the root; what it is that's sent and stored, Segment says.
  template <typename Segment>
  ListsOf<Segment> makeLists(const Prepared& prepared, const GenerateSettings& settings,
                             const DepthCode& code, const Progress& progress) {
    const bool alone = comm.size() == 1;
    Stopwatch watch;
    ListsOf<Segment> lists;
    cancellable(progress, 0.8, [&](const detail::RayCaster::Progress& report) {
      lists = caster->lists<Segment>(
          {shown.scene, prepared.view, prepared.lattice, prepared.table, settings, !alone, false, code},
          report, takeSpare<Segment>());
    });
    mine.subSupersegments = lists.segments.size();
    mine.generateSeconds = watch.lap();
    noteTimes();
    if (alone) return lists;
    comm::Received<Segment> received = comm::distribute(comm, lists);
    spare = std::exchange(lists, {});
    mine.bytesSent = received.bytesSent;
    mine.distributeSeconds = watch.lap();
    detail::Compositor::Request request{settings.supersegments,
                                        mostPerList(settings.supersegments, settings.budget),
                                        prepared.lattice.step,
                                        settings.algorithm,
                                        code,
                                        -1.0F};
    if (settings.budget == Budget::Total) {
      Survey survey;
      comm.together([&] { survey = compositor->survey(received.subLists, request); });
      comm.allReduceSum(survey.supersegments);
      comm.allReduceSum(std::span(&survey.equally, 1));
      request.level = survey.levelFor(settings.fill);
    }
    cancellable(progress, 0.95, [&](const detail::RayCaster::Progress& report) {
      lists = compositor->composite(received.subLists, request);
      report(1.0);
    });
    received = {};
    mine.compositeSeconds = watch.lap();
    lists = comm::gatherLists(comm, lists, root);
    mine.gatherSeconds = watch.lap();
    return lists;
  }

  void noteTimes() {
    mine.generateDeviceSeconds = 1e-3 * caster->times().all;
    mine.searchSeconds = 1e-3 * caster->times().search;
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
  vdi.budget = mostPerList(settings.supersegments, settings.budget);
  vdi.bounds = s.shown.scene.bounds;
  vdi.sampleStep = prepared->lattice.step;
  return vdi;
}

void VdiGenerator::recycle(Vdi&& vdi) {
  state_->spare = std::move(vdi.lists);
}

void VdiGenerator::recycle(Image&& image) {
  state_->spareImage = std::move(image);
}

std::optional<Image> VdiGenerator::renderVolume(const Camera& camera,
                                                const TransferFunction& transferFunction,
                                                const GenerateSettings& settings, const Progress& progress) {
  State& s = *state_;
  const auto prepared = s.prepare(camera, transferFunction, settings);
  const bool alone = s.comm.size() == 1;
  Stopwatch watch;
  const detail::RayCaster::Request request{
      s.shown.scene, prepared->view, prepared->lattice, prepared->table, settings, !alone, !alone, {}};
  Image image = std::exchange(s.spareImage, {});
  SupersegmentLists lists;
  s.cancellable(progress, 0.9, [&](const detail::RayCaster::Progress& report) {
    if (alone) {
      image = s.caster->image(request, report, std::move(image));
    } else {
      lists = s.caster->lists<Supersegment>(request, report);
    }
  });
  s.mine.subSupersegments = lists.segments.size();
  s.mine.generateSeconds = watch.lap();
  s.noteTimes();
  if (!alone) {
    // The limit case of the paper's section 5.3: one supersegment a run, composited in order of depth.
    const comm::Received<Supersegment> received = comm::distribute(s.comm, lists);
    s.mine.bytesSent = received.bytesSent;
    s.mine.distributeSeconds = watch.lap();
    const std::size_t owned = received.subLists.front().listCount();
    std::vector<glm::vec4> rgba(owned);
    std::vector<float> depth(owned);
    detail::flattenMerged(received.subLists, rgba, depth);
    s.mine.compositeSeconds = watch.lap();
    const auto colors = s.comm.gather(std::as_bytes(std::span(rgba)), sizeof(glm::vec4), root);
    const auto depths = s.comm.gather(std::as_bytes(std::span(depth)), sizeof(float), root);
    if (s.comm.rank() == root) {
      image.width = settings.width;
      image.height = settings.height;
      image.rgba.resize(image.pixelCount());
      image.depth.resize(image.pixelCount());
      copyInParallel(colors.bytes, image.rgba.data());
      copyInParallel(depths.bytes, image.depth.data());
    }
    s.mine.gatherSeconds = watch.lap();
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
