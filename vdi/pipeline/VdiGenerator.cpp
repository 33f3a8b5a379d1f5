// The stages of a frame, and its outcome.
#include "vdi/pipeline/VdiGenerator.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <array>
#include <cstring>
#include <exception>
#include <functional>
#include <span>
#include <tuple>
#include <type_traits>
#include <utility>

#include "vdi/core/Margin.h"
#include "vdi/core/SettingsTable.h"
#include "vdi/pipeline/BandDownload.h"
#include "vdi/pipeline/BandMaker.h"
#include "vdi/pipeline/Extremes.h"
#include "vdi/pipeline/FileSink.h"
#include "vdi/pipeline/Fingerprint.h"
#include "vdi/pipeline/Frames.h"
#include "vdi/pipeline/HostSinks.h"
#include "vdi/pipeline/Stages.h"
#include "vdi/pipeline/TimeSteps.h"
#include "vdi/pipeline/VdiRenderer.h"

namespace vdi {

namespace {

constexpr int root = 0;

/// Throws Error{InvalidArgument} if the device can't tell the samples apart, or take all of them.
void requireTractable(const DepthLattice& lattice, const gpu::Device& device) {
  if (!floatsResolve(lattice)) {
    throw Error(
        ErrorCode::InvalidArgument,
        fmt::format("the camera is {:.3g} away from the scene, and one sample is {:.3g} long: move it "
                    "nearer, or take fewer samples per voxel",
                    lattice.first, lattice.step));
  }
  // Lavapipe silently ends an invocation's loops after 65535 passes.
  constexpr std::uint32_t mostOnCpu = 60000;
  if (device.isCpu() && lattice.count > mostOnCpu) {
    throw Error(
        ErrorCode::InvalidArgument,
        fmt::format("a ray would need {} samples, and a CPU device takes {} at most: take fewer samples "
                    "per voxel",
                    lattice.count, mostOnCpu));
  }
}

/// Whether depths of the settings' samples have codes, which compact lists need, and the device can take the
/// samples.
bool canBeCompact(const Scene& scene, const Camera& camera, const GenerateSettings& settings,
                  const gpu::Device& device) {
  const DepthLattice lattice =
      depthLattice(scene, viewWithMargin(scene, camera, settings), settings.samplesPerVoxel);
  try {
    requireTractable(lattice, device);
  } catch (const Error&) {
    return false;
  }
  return depthCodeFor(lattice).exists();
}

/// The settings' rate, or the least power of two times it at which samples are slabs: only slabs show the
/// values between two samples.
double rateOfSlabs(const Scene& scene, const Camera& camera, const GenerateSettings& settings) {
  const View view = viewWithMargin(scene, camera, settings);
  double rate = settings.samplesPerVoxel;
  const auto areSlabs = [&] {
    const DepthLattice lattice = depthLattice(scene, view, rate);
    return lattice.count == 0 || samplesAreSlabs(scene, view, lattice);
  };
  while (!areSlabs()) rate *= 2.0;
  return rate;
}

}  // namespace

struct VdiFrame::State : detail::FrameState {};

struct VdiGenerator::State {
  explicit State(std::shared_ptr<gpu::Device> theDevice) : device(std::move(theDevice)) {}

  /// Collective. Call once, first.
  void begin(comm::Communicator theComm, const GeneratorOptions& options) {
    comm = std::move(theComm);
    comm.together([&] {
      const comm::Transport transport = options.transport;
      const bool shares = comm.size() > 1 && transport == comm::Transport::Shared;
      using Visible = detail::HostPool::Visible;
      pool = std::make_shared<detail::HostPool>(device, shares ? Visible::ToHost : Visible::ToProcess);
      bands = std::make_unique<detail::BandMaker>(device, comm, options);
      steps = std::make_unique<detail::TimeSteps>(comm, bands->caster().volume());
      frames = std::make_shared<detail::Frames>(device, comm, transport, root);
      bandDownload = std::make_unique<detail::BandDownload>(device);
      gone = std::make_exception_ptr(
          Error(ErrorCode::InvalidArgument, "the frame's generator no longer exists"));
    });
  }
  ~State() {
    if (!gone) return;  // it never began
    drop(gone);         // handles of frames may outlive the generator
    pool->detach();     // VDIs may outlive this
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  State(State&&) = delete;
  State& operator=(State&&) = delete;

  std::shared_ptr<gpu::Device> device;
  comm::Communicator comm = comm::Communicator::serial();  // until it begins
  std::shared_ptr<detail::HostPool> pool;                  // memory of VDIs and pictures
  std::unique_ptr<detail::BandMaker> bands;
  std::unique_ptr<detail::TimeSteps> steps;
  std::shared_ptr<detail::Frames> frames;
  std::unique_ptr<detail::BandDownload> bandDownload;  // for lists that go into a file
  std::vector<detail::BandMaker::FlatBand> flat;
  /// Settings and size of the last frame.
  std::optional<std::tuple<GenerateSettings, int, int>> lastKind;
  detail::Expectation expected;
  TransferFunction tableOf;  // most frames have the function of the frame before
  std::shared_ptr<const TransferTable> table;
  std::exception_ptr gone;  // the error of frames that outlive this; made early, as a destructor can't fail
  RankReport mine;
  std::vector<RankReport> reports;

  /// Checked parameters, which all functions that make frames share.
  struct Prepared {
    View view;
    DepthLattice lattice;
    double samplesPerVoxel = 1.0;  // never automaticRate
    std::shared_ptr<const TransferTable> table;
    TransferFunction legend;            // the function, simplified
    std::vector<ColorNode> colorNodes;  // of a volume with one value for colours
  };

  enum class For { Vdi, Picture };

  std::unique_ptr<Prepared> prepare(const Camera& camera, const TransferFunction& function,
                                    const GenerateSettings& settings, For result) {
    comm.requireEqual([&] { return detail::fingerprintsOf(camera, function, settings); });
    std::unique_ptr<Prepared> prepared;
    comm.together([&] {
      validate(settings);
      if (result == For::Vdi) requireComposite(settings.blending);
      const Scene& scene = steps->scene();
      if (steps->colors() > 0 && settings.blending.projects()) {
        throw Error(ErrorCode::InvalidArgument,
                    "maximum and minimum intensities need a single component, not components together");
      }
      // Beside colours of other values, the table has the opacities alone.
      TransferFunction opacities;
      if (steps->colors() > 0) {
        opacities = function;
        opacities.colors = {{0.0, glm::dvec3(1.0)}};
      }
      const TransferFunction& tabled = steps->colors() > 0 ? opacities : function;
      if (!table || tabled != tableOf) {
        auto made = std::make_shared<const TransferTable>(bake(tabled));
        tableOf = TransferFunction(tabled);  // moved, so that no failure parts the two
        table = std::move(made);
      }
      GenerateSettings own = settings;
      if (settings.samplesPerVoxel == automaticRate) {
        // Nearest values make right pictures at any rate, but faces between voxels lie within a sample.
        own.samplesPerVoxel = settings.interpolation == Interpolation::Nearest
                                  ? rateOfNearest
                                  : steps->samplingRate(*table, settings.region);
      }
      // The compact form matters more than extra samples.
      while (settings.samplesPerVoxel == automaticRate && own.samplesPerVoxel > 1.0 &&
             !canBeCompact(scene, camera, own, *device))
        own.samplesPerVoxel *= 0.5;
      if (settings.blending.mode == BlendMode::Isosurface)
        own.samplesPerVoxel = rateOfSlabs(scene, camera, own);
      const View view = viewWithMargin(scene, camera, own);
      prepared = std::make_unique<Prepared>(
          Prepared{view, depthLattice(scene, view, own.samplesPerVoxel), own.samplesPerVoxel, table,
                   simplified(steps->colors() == 3 ? opacities : function),
                   steps->colors() == 1 ? function.colors : std::vector<ColorNode>()});
      requireTractable(prepared->lattice, *device);
      steps->requireSpans(*prepared->table);
    });
    mine = {};
    mine.samplesPerVoxel = prepared->samplesPerVoxel;
    steps->report(mine);
    return prepared;
  }

  detail::RayCaster::Inputs castInputsOf(const Prepared& prepared, const GenerateSettings& settings,
                                         const ListForm& form, bool runsOnly = false) const {
    return {steps->scene(), prepared.view, prepared.lattice,   *prepared.table, settings, comm.size() > 1,
            runsOnly,       form,          prepared.colorNodes};
  }

  /// Runs the work of a frame. After an error, no work may continue in memory that the next frame takes, so
  /// frames that were started before fail too.
  template <typename Work>
  void frame(Work work) {
    try {
      work();
    } catch (...) {
      drop(std::current_exception());
      throw;
    }
  }

  void drop(const std::exception_ptr& error) noexcept {
    bands->drop();
    frames->drop(error);
  }

  /// Collective: completes the frame, or makes it fail, on all ranks.
  void complete(detail::FrameState& unfinished) {
    if (!unfinished.sink) return;
    try {
      frame([&] {
        frames->addLastBands();
        unfinished.sink->finish(unfinished.report);
        unfinished.reports = gatherReports(unfinished.report);
      });
      unfinished.sink.reset();
    } catch (...) {  // finish rethrows it for the frame's owner
    }
  }

  void completeAll() {
    for (const detail::Flight& flight : frames->flights) {
      if (flight.frame) complete(*flight.frame);
    }
  }

  /// Collective: a flight without a frame under way.
  detail::Flight& freeFlight() {
    detail::Flight& flight = frames->next();
    if (flight.frame) complete(*flight.frame);
    if (!frames->underWay()) bands->restart();
    return flight;
  }

  /// Collective: makes the VDI's lists and hands them to the sink; with several ranks, all but the last band.
  void makeLists(const Prepared& prepared, const GenerateSettings& settings, const Vdi& header,
                 std::vector<detail::OwnedLists>& owned, detail::VdiSink& sink, const Progress& progress) {
    const detail::RayCaster::Inputs inputs = castInputsOf(prepared, settings, header.form());
    sink.begin(header);
    if (comm.size() == 1) {
      bands->makeAlone(inputs, progress, sink, mine);
    } else {
      bands->makeComposited(
          inputs, progress, owned, [this] { frames->addLastBands(); }, sink, mine);
    }
  }

  /// Collective: runs a whole frame, from the parameters to the reports, through `make`.
  template <typename Make>
  void wholeFrame(const Progress& progress, Make make) {
    completeAll();
    frame(make);
    reports = gatherReports(mine);
    if (progress) progress(1.0);
  }

  /// Collective: runs a whole frame whose lists go to the sink.
  void wholeVdi(const Prepared& prepared, const GenerateSettings& settings, const Vdi& header,
                detail::VdiSink& sink, const Progress& progress) {
    wholeFrame(progress, [&] {
      try {
        std::vector<detail::OwnedLists>& owned = frames->flights.front().owned;
        makeLists(prepared, settings, header, owned, sink, progress);
        if (comm.size() > 1) bands->addLast(owned, sink, mine);
        sink.finish(mine);
      } catch (...) {
        sink.fail();
        throw;
      }
    });
  }

  /// Makes a sink for the root's memory. Segment is the type that is sent and stored.
  template <typename Segment>
  std::unique_ptr<detail::VdiSink> hostSink(detail::Flight& flight, Vdi& vdi) {
    if (comm.size() == 1) return std::make_unique<detail::DownloadSink<Segment>>(pool, flight, vdi, expected);
    return std::make_unique<detail::GatherSink<Segment>>(comm, root, pool, flight, vdi, expected);
  }

  /// A VDI without its lists, but in their form.
  Vdi headerOf(const Prepared& prepared, const Camera& camera, const GenerateSettings& settings) const {
    Vdi vdi;
    vdi.camera = camera;
    vdi.width = prepared.view.width();
    vdi.height = prepared.view.height();
    vdi.margin = (glm::ivec2(vdi.width, vdi.height) - glm::ivec2(settings.width, settings.height)) / 2;
    vdi.budget = maxPerList(settings.supersegments, settings.budget);
    // Even if nothing is visible, the VDI keeps the scene's bounds.
    const Box shown = boundsIn(settings.region, steps->scene().bounds);
    vdi.bounds = shown.empty() ? steps->scene().bounds : shown;
    vdi.sampleStep = prepared.lattice.step;
    Coloring& coloring = vdi.coloring.emplace();
    coloring.range = steps->coloredRange();
    coloring.function = prepared.legend;
    if (hasDepthCode(settings.precision)) vdi.depthCode = depthCodeFor(prepared.lattice);
    const bool isPossible = !hasDepthCode(settings.precision) || vdi.depthCode.exists();
    vdi.lists = noLists(isPossible ? settings.precision : Precision::Full);
    return vdi;
  }

  /// Collective: renders the picture of all ranks' volumes, on the root.
  void renderTogether(const Prepared& prepared, const GenerateSettings& settings, const Progress& progress,
                      Image& image) {
    detail::Gather& gather = *frames->flights.front().gather;
    comm.together([&] {
      if (comm.rank() == root) image = imageIn(settings);
    });
    gather.begin(*pool, std::array{std::as_writable_bytes(std::span(image.rgba)),
                                   std::as_writable_bytes(std::span(image.depth))});
    const auto send = [&](std::size_t band) {
      const detail::BandMaker::FlatBand& own = flat[band];
      constexpr std::uint64_t colorBytes = sizeof(glm::vec4);
      constexpr std::uint64_t depthBytes = sizeof(float);
      const std::array pieces{
          detail::Gather::Piece{&own.colors, 0, own.firstPixel * colorBytes, own.pixelCount * colorBytes},
          detail::Gather::Piece{&own.depths, 1, own.firstPixel * depthBytes, own.pixelCount * depthBytes}};
      detail::Stopwatch watch;
      comm.together([&] {
        gather.send(pieces, own.flattened);  // its size does not depend on what was composited
        bands->compositor().finish();
      });
      mine.compositeSeconds += watch.lap();
    };
    bands->makeFlat(castInputsOf(prepared, settings, {}, true), progress, flat, send, mine);
    send(flat.size() - 1);
    mine.compositeDeviceSeconds = 1e-3 * bands->compositor().takeMilliseconds();
    detail::Stopwatch watch;
    gather.finish();
    mine.bytesSent += gather.bytesSent();
    mine.gatherSeconds = watch.lap();
  }

  /// Renders the picture with one rank.
  void renderAlone(const Prepared& prepared, const GenerateSettings& settings, const Progress& progress,
                   Image& image) {
    image = imageIn(settings);
    bands->render(castInputsOf(prepared, settings, {}), progress, *pool, image, mine);
  }

  /// Collective: renders the picture of the extreme scalars along the rays, on the root. Ranks need no lists,
  /// because the order of samples doesn't matter: each pixel's largest key is the result.
  void project(const Prepared& prepared, const GenerateSettings& settings, const Progress& progress,
               HostVector<std::uint64_t>& extremes, Image& image) {
    comm.together([&] {
      extremes.resize(static_cast<std::size_t>(settings.width) * static_cast<std::size_t>(settings.height));
      if (comm.rank() == root) image = imageIn(settings);
    });
    bands->project(castInputsOf(prepared, settings, {}), progress, *pool, extremes, mine);
    detail::Stopwatch watch;
    comm.reduceMax(extremes, root);
    if (comm.rank() != root) mine.bytesSent += extremes.size() * sizeof(std::uint64_t);
    mine.gatherSeconds = watch.lap();
    comm.together([&] {
      if (comm.rank() == root)
        detail::colorExtremes(extremes, settings.blending.mode, *prepared.table, image);
    });
    mine.compositeSeconds = watch.lap();
  }

  /// An image of the settings' size, not cleared.
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

  /// Collective: returns all ranks' reports on the root.
  std::vector<RankReport> gatherReports(RankReport& report) const {
    static_assert(std::is_trivially_copyable_v<RankReport>);
    report.deviceBytes = device->allocatedBytes();
    rusage usage{};
    constexpr std::uint64_t unit = 1024;
    if (::getrusage(RUSAGE_SELF, &usage) == 0)
      report.hostPeakBytes = static_cast<std::uint64_t>(usage.ru_maxrss) * unit;
    const comm::Gathered all = comm.gather(std::as_bytes(std::span(&report, 1)), sizeof(RankReport), root);
    std::vector<RankReport> result;
    comm.together([&] {
      result.resize(all.bytes.size() / sizeof(RankReport));
      if (!result.empty()) std::memcpy(result.data(), all.bytes.data(), all.bytes.size());
    });
    return result;
  }
};

VdiGenerator::VdiGenerator(std::shared_ptr<gpu::Device> device, comm::Communicator comm,
                           const GeneratorOptions& options) {
  comm.together([&] { state_ = std::make_unique<State>(std::move(device)); });
  state_->begin(std::move(comm), options);
}

VdiGenerator::~VdiGenerator() = default;

void VdiGenerator::setBlocks(std::vector<Block> blocks, bool fillGhosts) {
  state_->steps->setBlocks(std::move(blocks), fillGhosts);
}

void VdiGenerator::setNextBlocks(std::vector<Block> blocks, bool fillGhosts) {
  state_->steps->setNextBlocks(std::move(blocks), fillGhosts);
}

void VdiGenerator::advance() {
  state_->steps->advance();
}

std::optional<Vdi> VdiGenerator::generate(const Camera& camera, const TransferFunction& transferFunction,
                                          const GenerateSettings& settings, const Progress& progress) {
  std::optional<Vdi> vdi = finish(start(camera, transferFunction, settings, progress));
  if (progress) progress(1.0);
  return vdi;
}

VdiFrame VdiGenerator::start(const Camera& camera, const TransferFunction& transferFunction,
                             const GenerateSettings& settings, const Progress& progress) {
  State& s = *state_;
  const auto prepared = s.prepare(camera, transferFunction, settings, State::For::Vdi);
  // Memory in use by a frame is not replaced, so a frame of another size waits for it.
  std::optional<std::tuple<GenerateSettings, int, int>> kind;
  s.comm.together([&] { kind.emplace(settings, prepared->view.width(), prepared->view.height()); });
  if (s.lastKind != kind) s.completeAll();
  detail::Flight& flight = s.freeFlight();
  s.lastKind = std::move(kind);
  std::shared_ptr<VdiFrame::State> frame;
  std::unique_ptr<detail::VdiSink> sink;
  std::function<void()> addLastBand;
  s.comm.together([&] {
    frame = std::make_shared<VdiFrame::State>();
    frame->owner = s.frames;
    frame->vdi = s.headerOf(*prepared, camera, settings);
    sink = withSegment(frame->vdi.precision(),
                       [&]<typename Segment>() { return s.hostSink<Segment>(flight, frame->vdi); });
    addLastBand = [&s, &flight, made = frame.get()] {
      s.bands->addLast(flight.owned, *made->sink, made->report);
    };
  });
  flight.frame = frame;
  s.frame([&] { s.makeLists(*prepared, settings, frame->vdi, flight.owned, *sink, progress); });
  frame->sink = std::move(sink);
  frame->report = s.mine;
  if (s.comm.size() > 1) frame->addLastBand = std::move(addLastBand);
  return VdiFrame(frame);
}

std::optional<Vdi> VdiGenerator::finish(VdiFrame frame) {
  State& s = *state_;
  s.comm.together([&] {
    if (!frame.state_) throw Error(ErrorCode::InvalidArgument, "there is no frame to finish");
    // A failed frame tells its own error; only the owner has the last bands of another.
    if (!frame.state_->error && frame.state_->owner.lock() != s.frames)
      throw Error(ErrorCode::InvalidArgument, "another generator started this frame");
  });
  s.complete(*frame.state_);
  if (frame.state_->error) std::rethrow_exception(frame.state_->error);
  s.reports = std::move(frame.state_->reports);
  if (s.comm.rank() != root) return std::nullopt;
  return std::move(frame.state_->vdi);
}

WrittenVdi VdiGenerator::write(const std::filesystem::path& path, const Camera& camera,
                               const TransferFunction& transferFunction, const GenerateSettings& settings,
                               const TimeStamp& stamp, const Progress& progress) {
  State& s = *state_;
  const auto prepared = s.prepare(camera, transferFunction, settings, State::For::Vdi);
  Vdi header;
  s.comm.together([&] {
    header = s.headerOf(*prepared, camera, settings);
    header.time = stamp.time;
    header.timeStep = stamp.step;
    header.coloring->array = stamp.array;
  });
  return withSegment(header.precision(), [&]<typename Segment>() {
    detail::FileSink<Segment> sink(s.comm, root, path, *s.bandDownload);  // allocates no memory
    s.wholeVdi(*prepared, settings, header, sink, progress);
    return sink.written();
  });
}

void VdiGenerator::show(VdiRenderer* renderer, const Camera& camera, const TransferFunction& transferFunction,
                        const GenerateSettings& settings, const Progress& progress) {
  State& s = *state_;
  s.comm.together([&] {
    if (s.comm.rank() == root && renderer == nullptr)
      throw Error(ErrorCode::InvalidArgument, "there is no renderer to show a VDI");
  });
  if (s.comm.size() == 1) {
    if (const std::unique_ptr<detail::VdiSink> sink = renderer->sinkFor(*s.device)) {
      const auto prepared = s.prepare(camera, transferFunction, settings, State::For::Vdi);
      s.wholeVdi(*prepared, settings, s.headerOf(*prepared, camera, settings), *sink, progress);
      return;
    }
  }
  const std::optional<Vdi> vdi = generate(camera, transferFunction, settings, progress);
  s.comm.together([&] {
    if (vdi) renderer->setVdi(*vdi);
  });
}

VdiFrame::VdiFrame(std::shared_ptr<State> state) : state_(std::move(state)) {}
VdiFrame::~VdiFrame() = default;
VdiFrame::VdiFrame(VdiFrame&&) noexcept = default;
VdiFrame& VdiFrame::operator=(VdiFrame&&) noexcept = default;

std::optional<Image> VdiGenerator::renderVolume(const Camera& camera,
                                                const TransferFunction& transferFunction,
                                                const GenerateSettings& asked, const Progress& progress) {
  State& s = *state_;
  GenerateSettings settings;
  s.comm.together([&] { settings = asked; });
  settings.margin = 0.0;
  const auto prepared = s.prepare(camera, transferFunction, settings, State::For::Picture);
  Image image;  // devices may still write to these when `frame` handles an error
  HostVector<std::uint64_t> extremes{HostAllocator<std::uint64_t>(s.pool)};
  s.wholeFrame(progress, [&] {
    if (settings.blending.projects()) {
      s.project(*prepared, settings, progress, extremes, image);
    } else if (s.comm.size() > 1) {
      s.renderTogether(*prepared, settings, progress, image);
    } else {
      s.renderAlone(*prepared, settings, progress, image);
    }
  });
  if (s.comm.rank() != root) return std::nullopt;
  return image;
}

const Scene& VdiGenerator::scene() const {
  return state_->steps->scene();
}
const ScalarRange& VdiGenerator::scalarRange() const {
  return state_->steps->scalarRange();
}

const ScalarRange& VdiGenerator::coloredRange() const {
  return state_->steps->coloredRange();
}
std::optional<ScalarRange> VdiGenerator::crowdedPart() const {
  return state_->steps->crowdedPart();
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
