// VdiGenerator: which stages a frame takes, and what becomes of it.
#include <sys/resource.h>

#include <array>
#include <cstring>
#include <exception>
#include <span>
#include <tuple>
#include <type_traits>
#include <utility>

#include "vdi/core/Margin.h"
#include "vdi/pipeline/BandDownload.h"
#include "vdi/pipeline/BandMaker.h"
#include "vdi/pipeline/Fingerprint.h"
#include "vdi/pipeline/Frames.h"
#include "vdi/pipeline/Pipeline.h"
#include "vdi/pipeline/Stages.h"
#include "vdi/pipeline/Tails.h"
#include "vdi/pipeline/TimeSteps.h"
#include "vdi/pipeline/VdiLoader.h"
#include "vdi/pipeline/VdiWriter.h"

namespace vdi {

namespace {

constexpr int root = 0;

}  // namespace

struct VdiFrame::State : detail::Frame {};

struct VdiGenerator::State {
  State(std::shared_ptr<gpu::Device> theDevice, comm::Communicator theComm)
      : device(std::move(theDevice)), comm(std::move(theComm)) {
    const std::string ways = comm.environment("VDI_TRANSPORT");
    comm.together([&] {
      const comm::Transport transport = comm::transportFromText(ways);
      const bool shares = comm.size() > 1 && transport == comm::Transport::Shared;
      using Visible = detail::HostPool::Visible;
      pool = std::make_shared<detail::HostPool>(device, shares ? Visible::ToHost : Visible::ToProcess);
      bands = std::make_unique<detail::BandMaker>(device, comm, transport);
      steps = std::make_unique<detail::TimeSteps>(comm, bands->caster().volume());
      frames = std::make_unique<detail::Frames>(device, comm, transport, root);
      bandDownload = std::make_unique<detail::BandDownload>(device);
    });
  }
  ~State() {
    drop();          // handles of frames may outlive this
    pool->detach();  // VDIs may outlive this
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  State(State&&) = delete;
  State& operator=(State&&) = delete;

  std::shared_ptr<gpu::Device> device;
  comm::Communicator comm;
  std::shared_ptr<detail::HostPool> pool;  // of VDIs and pictures
  std::unique_ptr<detail::BandMaker> bands;
  std::unique_ptr<detail::TimeSteps> steps;
  std::unique_ptr<detail::Frames> frames;
  std::unique_ptr<detail::BandDownload> bandDownload;  // of what goes into a file
  std::vector<detail::BandMaker::FlatBand> flat;
  /// Settings and size of the last one.
  std::optional<std::tuple<GenerateSettings, int, int>> lastKind;
  detail::Expectation expected;
  RankReport mine;
  std::vector<RankReport> reports;

  /// What generate, write and renderVolume have in common: checked parameters.
  struct Prepared {
    View view;
    DepthLattice lattice;
    TransferTable table;
  };

  std::unique_ptr<Prepared> prepare(const Camera& camera, const TransferFunction& function,
                                    const GenerateSettings& settings) {
    comm.requireEqual(detail::fingerprintsOf(camera, function, settings));
    std::unique_ptr<Prepared> prepared;
    comm.together([&] {
      validate(settings);
      const View view = viewWithMargin(steps->scene(), camera, settings);
      prepared = std::make_unique<Prepared>(
          Prepared{view, depthLattice(steps->scene(), view, settings.samplesPerVoxel), bake(function)});
      steps->requireSpans(prepared->table);
    });
    mine = {};
    steps->report(mine);
    return prepared;
  }

  detail::RayCaster::Request requestOf(const Prepared& prepared, const GenerateSettings& settings,
                                       const DepthCode& code, bool runsOnly = false) const {
    return {steps->scene(), prepared.view,   prepared.lattice, prepared.table,
            settings,       comm.size() > 1, runsOnly,         code};
  }

  /// What makes a frame. After an error nothing goes on in memory that the next frame takes: frames that were
  /// started before and aren't done fail too.
  template <typename Work>
  auto frame(Work work) {
    try {
      return work();
    } catch (...) {
      drop();
      throw;
    }
  }

  void drop() noexcept {
    bands->drop();
    frames->drop();
  }

  /// Collective: the frame is done, or has failed, on all ranks.
  void complete(detail::Frame& unfinished) {
    if (!unfinished.tail) return;
    try {
      frame([&] {
        frames->passOn();
        unfinished.tail->finish(unfinished.vdi, unfinished.report);
        unfinished.reports = gatherReports(unfinished.report);
      });
      unfinished.tail.reset();
    } catch (...) {  // for those who ask for this frame
    }
  }

  void completeAll() {
    for (const detail::Flight& flight : frames->flights) {
      if (flight.frame) complete(*flight.frame);
    }
  }

  /// Collective: one that no frame is under way in.
  detail::Flight& freeFlight() {
    detail::Flight& flight = frames->next();
    if (flight.frame) complete(*flight.frame);
    if (!frames->underWay()) bands->restart();
    return flight;
  }

  /// Collective: the VDI's lists, on their way to the root. What it is that's sent and stored, Segment says.
  template <typename Segment>
  std::unique_ptr<detail::Tail> makeLists(const Prepared& prepared, const GenerateSettings& settings,
                                          const DepthCode& code, detail::Flight& flight,
                                          const Progress& progress) {
    const detail::RayCaster::Request request = requestOf(prepared, settings, code);
    const std::uint64_t listCount = static_cast<std::uint64_t>(prepared.view.width()) *
                                    static_cast<std::uint64_t>(prepared.view.height());
    if (comm.size() == 1) {
      auto tail = std::make_unique<detail::TailAlone<Segment>>(pool, flight, listCount, expected);
      detail::ListDownload<Segment>& download = tail->download();
      using Lists = detail::DeviceLists;
      bands->makeAlone(request, progress,
                       {[&](gpu::Commands& commands, const Lists& lists, std::uint64_t firstList) {
                          download.recordOffsets(commands, lists, firstList);
                        },
                        [&](const Lists& lists, std::uint64_t) {
                          detail::Stopwatch watch;
                          const gpu::Submission sent = download.send(lists);
                          mine.generateSeconds += watch.lap();
                          return sent;
                        }},
                       mine);
      return tail;
    }
    auto tail = std::make_unique<detail::TailTogether<Segment>>(comm, root, pool, bands->compositor(), flight,
                                                                listCount, expected);
    bands->makeComposited(request, progress, flight.owned,
                          {[&] { frames->passOn(); }, [&](std::size_t band) { tail->pass(band); }}, mine);
    return tail;
  }

  /// Collective: a VDI of `header`, in a file.
  template <typename Segment>
  WrittenVdi writeFile(const std::filesystem::path& path, const Vdi& header, const Prepared& prepared,
                       const GenerateSettings& settings, const Progress& progress) {
    detail::VdiWriter<Segment> writer(comm, root, path, header);
    const detail::RayCaster::Request request = requestOf(prepared, settings, header.depthCode);
    // While the host encodes a band, the device makes the next one.
    const auto add = [&](const detail::DeviceLists& lists, std::uint64_t firstList) {
      detail::Stopwatch watch;
      if (lists.listCount > 0) writer.add(firstList, bandDownload->get<Segment>(lists));
      mine.outputSeconds += watch.lap();
      return gpu::Submission();
    };
    if (comm.size() == 1) {
      bands->makeAlone(request, progress, {{}, add}, mine);
    } else {
      std::vector<detail::OwnedLists>& owned = frames->flights.front().owned;
      const auto pass = [&](std::size_t band) {
        comm.together([&] {
          bands->compositor().finish();
          add(owned[band].lists, owned[band].firstList);
        });
      };
      bands->makeComposited(request, progress, owned, {[] {}, pass}, mine);
      mine.compositeSeconds -= mine.outputSeconds;  // of the bands that were added meanwhile
      pass(owned.size() - 1);
      mine.compositeDeviceSeconds = 1e-3 * bands->compositor().takeMilliseconds();
    }
    detail::Stopwatch watch;
    const WrittenVdi written = writer.finish();
    mine.outputSeconds += watch.lap();
    mine.bytesSent += writer.bytesSent();
    mine.bytesWritten = writer.bytesWritten();
    return written;
  }

  /// A VDI without its lists.
  Vdi headerOf(const Prepared& prepared, const Camera& camera, const GenerateSettings& settings) const {
    Vdi vdi;
    vdi.camera = camera;
    vdi.width = prepared.view.width();
    vdi.height = prepared.view.height();
    vdi.margin = (glm::ivec2(vdi.width, vdi.height) - glm::ivec2(settings.width, settings.height)) / 2;
    vdi.budget = maxPerList(settings.supersegments, settings.budget);
    // Where nothing is shown, the scene's bounds are still those of something.
    const Box shown = boundsIn(settings.region, steps->scene().bounds);
    vdi.bounds = shown.empty() ? steps->scene().bounds : shown;
    vdi.sampleStep = prepared.lattice.step;
    if (settings.precision == Precision::Compact) vdi.depthCode = depthCodeFor(prepared.lattice);
    return vdi;
  }

  /// Collective: the picture of all ranks' volumes, on the root.
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
      comm.together([&] {
        gather.send(pieces, own.flattened);  // how much that is doesn't depend on what was composited
        bands->compositor().finish();
      });
    };
    bands->makeFlat(requestOf(prepared, settings, {}, true), progress, flat, {[] {}, send}, mine);
    detail::Stopwatch watch;
    send(flat.size() - 1);
    mine.compositeDeviceSeconds = 1e-3 * bands->compositor().takeMilliseconds();
    mine.compositeSeconds += watch.lap();
    gather.finish();
    mine.bytesSent += gather.bytesSent();
    mine.gatherSeconds = watch.lap();
  }

  /// The same with one rank.
  void renderAlone(const Prepared& prepared, const GenerateSettings& settings, const Progress& progress,
                   Image& image) {
    image = imageIn(settings);
    bands->render(requestOf(prepared, settings, {}), progress, *pool, image, mine);
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

  /// Collective: all ranks', on the root.
  std::vector<RankReport> gatherReports(RankReport& report) const {
    static_assert(std::is_trivially_copyable_v<RankReport>);
    report.deviceBytes = device->allocatedBytes();
    rusage usage{};
    constexpr std::uint64_t unit = 1024;
    if (::getrusage(RUSAGE_SELF, &usage) == 0)
      report.hostPeakBytes = static_cast<std::uint64_t>(usage.ru_maxrss) * unit;
    const comm::Gathered all = comm.gather(std::as_bytes(std::span(&report, 1)), sizeof(RankReport), root);
    std::vector<RankReport> result(all.bytes.size() / sizeof(RankReport));
    if (!result.empty()) std::memcpy(result.data(), all.bytes.data(), all.bytes.size());
    return result;
  }
};

VdiGenerator::VdiGenerator(std::shared_ptr<gpu::Device> device, comm::Communicator comm)
    : state_(std::make_unique<State>(std::move(device), std::move(comm))) {}

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
  const auto prepared = s.prepare(camera, transferFunction, settings);
  // Memory that a frame uses isn't replaced: one of another size waits for it.
  const std::tuple kind(settings, prepared->view.width(), prepared->view.height());
  if (s.lastKind != kind) s.completeAll();
  detail::Flight& flight = s.freeFlight();
  s.lastKind = kind;
  const auto frame = std::make_shared<VdiFrame::State>();
  flight.frame = frame;
  frame->vdi = s.headerOf(*prepared, camera, settings);
  const DepthCode code = frame->vdi.depthCode;
  frame->tail = s.frame([&] {
    return code.step > 0.0F ? s.makeLists<CompactSupersegment>(*prepared, settings, code, flight, progress)
                            : s.makeLists<Supersegment>(*prepared, settings, code, flight, progress);
  });
  frame->report = s.mine;
  return VdiFrame(frame);
}

std::optional<Vdi> VdiGenerator::finish(VdiFrame frame) {
  State& s = *state_;
  s.comm.together([&] {
    if (!frame.state_) throw Error(ErrorCode::InvalidArgument, "there is no frame to finish");
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
  const auto prepared = s.prepare(camera, transferFunction, settings);
  s.completeAll();
  Vdi header = s.headerOf(*prepared, camera, settings);
  header.time = stamp.time;
  header.timeStep = stamp.step;
  const WrittenVdi written = s.frame([&] {
    return header.depthCode.step > 0.0F
               ? s.writeFile<CompactSupersegment>(path, header, *prepared, settings, progress)
               : s.writeFile<Supersegment>(path, header, *prepared, settings, progress);
  });
  s.reports = s.gatherReports(s.mine);
  if (progress) progress(1.0);
  return written;
}

void VdiGenerator::show(VdiRenderer* renderer, const Camera& camera, const TransferFunction& transferFunction,
                        const GenerateSettings& settings, const Progress& progress) {
  State& s = *state_;
  s.comm.together([&] {
    if (s.comm.rank() == root && renderer == nullptr)
      throw Error(ErrorCode::InvalidArgument, "there is no renderer to show a VDI");
  });
  if (s.comm.size() > 1 || renderer->device() != s.device.get()) {
    const std::optional<Vdi> vdi = generate(camera, transferFunction, settings, progress);
    s.comm.together([&] {
      if (vdi) renderer->setVdi(*vdi);
    });
    return;
  }
  const auto prepared = s.prepare(camera, transferFunction, settings);
  s.completeAll();
  const Vdi header = s.headerOf(*prepared, camera, settings);
  s.frame([&] {
    try {
      detail::VdiLoader& loader = renderer->loadShown(header);
      const auto add = [&](const detail::DeviceLists& lists, std::uint64_t firstList) {
        return loader.add(lists, firstList);
      };
      s.bands->makeAlone(s.requestOf(*prepared, settings, header.depthCode), progress, {{}, add}, s.mine);
      loader.finish();
    } catch (...) {
      renderer->showNothing();
      throw;
    }
  });
  s.reports = s.gatherReports(s.mine);
  if (progress) progress(1.0);
}

VdiFrame::VdiFrame(std::shared_ptr<State> state) : state_(std::move(state)) {}
VdiFrame::~VdiFrame() = default;
VdiFrame::VdiFrame(VdiFrame&&) noexcept = default;
VdiFrame& VdiFrame::operator=(VdiFrame&&) noexcept = default;

std::optional<Image> VdiGenerator::renderVolume(const Camera& camera,
                                                const TransferFunction& transferFunction,
                                                const GenerateSettings& asked, const Progress& progress) {
  State& s = *state_;
  GenerateSettings settings = asked;
  settings.margin = 0.0;
  const auto prepared = s.prepare(camera, transferFunction, settings);
  s.completeAll();
  Image image;  // which devices may still write to when `frame` handles an error
  s.frame([&] {
    if (s.comm.size() > 1) {
      s.renderTogether(*prepared, settings, progress, image);
    } else {
      s.renderAlone(*prepared, settings, progress, image);
    }
  });
  s.reports = s.gatherReports(s.mine);
  if (progress) progress(1.0);
  if (s.comm.rank() != root) return std::nullopt;
  return image;
}

const Scene& VdiGenerator::scene() const {
  return state_->steps->scene();
}
const ScalarRange& VdiGenerator::scalarRange() const {
  return state_->steps->scalarRange();
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
