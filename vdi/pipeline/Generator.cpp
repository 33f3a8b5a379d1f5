// VdiGenerator: the four stages in order, and who waits for whom.
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <exception>
#include <functional>
#include <limits>
#include <span>
#include <tuple>
#include <type_traits>
#include <utility>

#include "vdi/comm/ByteSum.h"
#include "vdi/comm/Exchange.h"
#include "vdi/comm/GhostExchange.h"
#include "vdi/comm/GlobalScene.h"
#include "vdi/comm/Ownership.h"
#include "vdi/core/Error.h"
#include "vdi/core/Margin.h"
#include "vdi/pipeline/BandDownload.h"
#include "vdi/pipeline/Compositor.h"
#include "vdi/pipeline/Distributor.h"
#include "vdi/pipeline/Fingerprint.h"
#include "vdi/pipeline/Gather.h"
#include "vdi/pipeline/GatheredLists.h"
#include "vdi/pipeline/Pipeline.h"
#include "vdi/pipeline/RayCaster.h"
#include "vdi/pipeline/VdiWriter.h"

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

/// What's left of a frame when its lists are made.
class Tail {
 public:
  Tail() = default;
  virtual ~Tail() = default;
  Tail(const Tail&) = delete;
  Tail& operator=(const Tail&) = delete;
  Tail(Tail&&) = delete;
  Tail& operator=(Tail&&) = delete;
  /// Collective: sends on what was composited last. The next frame may be made then.
  virtual void pass(RankReport& report) = 0;
  /// Collective: waits until the VDI has its lists.
  virtual void finish(Vdi& vdi, RankReport& report) = 0;
};

}  // namespace

/// Its generator has it too, as long as something is to be done.
struct VdiFrame::State {
  Vdi vdi;
  RankReport report;
  std::vector<RankReport> reports;
  std::unique_ptr<Tail> tail;  // none: done, or failed
  bool passed = false;
  std::exception_ptr error;
};

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
      for (Slot& slot : slots)
        slot.distributor = std::make_unique<detail::Distributor>(device, comm, transport);
      const auto opened = std::make_shared<detail::OpenedMemory>(device);
      for (Flight& flight : flights) {
        flight.gather = std::make_unique<detail::Gather>(device, comm, transport, root, opened);
        flight.downloads = std::make_unique<detail::DownloadMemory>(device);
      }
      bandDownload = std::make_unique<detail::BandDownload>(device);
      levelSum = std::make_unique<comm::ByteSum>(comm, transport);
      accesses = std::make_unique<detail::HostAccesses>(device);
    });
  }
  ~State() {
    drop();                    // handles of frames may outlive this
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
  std::unique_ptr<detail::BandDownload> bandDownload;  // of what goes into a file
  std::unique_ptr<comm::ByteSum> levelSum;
  std::unique_ptr<detail::HostAccesses> accesses;  // to the memory of levelSum
  /// What a band of this rank's own lists needs until it's passed on; bands take them in turns.
  struct Slot {
    detail::DeviceLists lists;
    comm::Ownership owned = comm::Ownership::equal(0, 1);
    std::unique_ptr<detail::Distributor> distributor;
    detail::Distributed parts;
    gpu::Submission usedBy;  // the lists' memory
  };
  std::array<Slot, detail::RayCaster::bandsAtOnce> slots;
  std::size_t firstSlot = 0;  // of the frame that's made
  Slot& slotOf(std::size_t band) { return slots[(firstSlot + band) % slots.size()]; }
  /// The next frame's first band isn't made where this one's last band still is.
  void freeSlots(std::size_t bands) { firstSlot = (firstSlot + bands) % slots.size(); }
  /// All ranks' supersegments of the lists that this rank owns, by band.
  struct MergedBand {
    std::uint64_t firstList = 0;  // of this rank's, in the picture
    detail::Compositor::Interleaved interleaved;
    gpu::Buffer colors;
    gpu::Buffer depths;
    gpu::Submission flattened;  // which writes these two
  };
  std::vector<MergedBand> merged;
  /// What a frame needs until it's on the root's host; frames take them in turns.
  struct Flight {
    std::vector<detail::OwnedLists> owned;  // by band
    std::unique_ptr<detail::Gather> gather;
    std::unique_ptr<detail::DownloadMemory> downloads;
    std::shared_ptr<VdiFrame::State> frame;  // that uses it, or did
  };
  std::array<Flight, 2> flights;
  std::size_t older = 0;  // of these, the one that wasn't taken last
  /// Settings and size of the last one.
  std::optional<std::tuple<std::uint64_t, int, int>> lastKind;
  std::uint64_t expectedSupersegments = 0;  // of a VDI: what the last one had
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
      const View view = viewWithMargin(shown.scene, camera, settings);
      prepared = std::make_unique<Prepared>(
          Prepared{view, depthLattice(shown.scene, view, settings.samplesPerVoxel), bake(function)});
      requireSpans(prepared->table);
    });
    const std::array prints{
        comm::Communicator::Fingerprint{detail::fingerprintOf(camera), "camera"},
        comm::Communicator::Fingerprint{detail::fingerprintOf(function), "transfer function"},
        comm::Communicator::Fingerprint{
            detail::fingerprintOf(settings),
            "resolution, margin, supersegments, budget, sampling rate, algorithm or precision"}};
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
    const bool cancelled = comm.anyTogether([&] {
      bool stop = false;
      work([&](double done) {
        if (progress && !progress(done * share)) stop = true;
        return !stop;
      });
      return stop;
    });
    if (cancelled) throw Error(ErrorCode::Cancelled, "stopped on request");
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
    caster->drop();
    for (Slot& slot : slots) slot.distributor->drop();
    compositor->drop();
    for (Flight& flight : flights) {
      flight.gather->drop();
      flight.downloads->commands.drop();
      if (!flight.frame || !flight.frame->tail) continue;
      flight.frame->tail.reset();
      flight.frame->error = std::current_exception();
    }
  }

  /// Collective: frames that were started before send on what was composited.
  void passOn() {
    for (const Flight& flight : flights) {
      if (!flight.frame || !flight.frame->tail || flight.frame->passed) continue;
      flight.frame->tail->pass(flight.frame->report);
      flight.frame->passed = true;
    }
  }

  /// Collective: the frame is done, or has failed, on all ranks.
  void complete(VdiFrame::State& unfinished) {
    if (!unfinished.tail) return;
    try {
      frame([&] {
        passOn();
        unfinished.tail->finish(unfinished.vdi, unfinished.report);
        unfinished.reports = gatherReports(unfinished.report);
      });
      unfinished.tail.reset();
    } catch (...) {  // for those who ask for this frame
    }
  }

  static bool underWay(const Flight& flight) { return flight.frame && flight.frame->tail; }

  /// Collective: the first one that no frame needs any more, so that frames that don't overlap always take
  /// the same memory. If there's none, the older frame is completed.
  Flight& freeFlight() {
    const auto found = std::ranges::find_if_not(flights, underWay);
    Flight& flight = found != flights.end() ? *found : flights[older];
    if (flight.frame) complete(*flight.frame);
    if (std::ranges::none_of(flights, underWay)) firstSlot = 0;
    older = &flight == &flights.front() ? 1 : 0;
    return flight;
  }

  void completeAll() {
    for (const Flight& flight : flights) {
      if (flight.frame) complete(*flight.frame);
    }
  }

  detail::RayCaster::Request requestOf(const Prepared& prepared, const GenerateSettings& settings,
                                       bool runsOnly, const DepthCode& code) const {
    return {shown.scene, prepared.view,   prepared.lattice, prepared.table,
            settings,    comm.size() > 1, runsOnly,         code};
  }

  /// Bands of a picture: as many rows each, but for the last one.
  struct Bands {
    std::uint32_t height = 0;
    std::uint32_t rows = 1;
    std::size_t count() const { return (height + rows - 1) / rows; }
    std::uint32_t first(std::size_t band) const { return static_cast<std::uint32_t>(band) * rows; }
    std::uint32_t last(std::size_t band) const { return std::min(height, first(band) + rows); }
    double doneWith(std::size_t band) const { return static_cast<double>(last(band)) / height; }
  };

  /// With one rank: the lists, which go to the host while the device makes the next ones.
  template <typename Segment>
  class TailAlone final : public Tail {
   public:
    TailAlone(State& state, Flight& flight, std::uint64_t listCount)
        : s_(state),
          lists_(detail::listsIn<Segment>(state.pool)),
          download_(lists_, *state.pool, *flight.downloads, listCount,
                    state.expectedSupersegments + state.expectedSupersegments / 8) {}
    detail::ListDownload<Segment>& download() { return download_; }
    void pass(RankReport&) override {}
    void finish(Vdi& vdi, RankReport& report) override {
      Stopwatch watch;
      download_.finish();
      s_.expectedSupersegments = lists_.segments.size();
      report.subSupersegments = lists_.segments.size();
      report.generateSeconds += watch.lap();
      vdi.lists = std::move(lists_);
    }

   private:
    State& s_;
    ListsOf<Segment> lists_;
    detail::ListDownload<Segment> download_;
  };

  /// What it is that's sent and stored, Segment says. With one rank.
  template <typename Segment>
  std::unique_ptr<Tail> makeListsAlone(const Prepared& prepared, const GenerateSettings& settings,
                                       const DepthCode& code, Flight& flight, const Progress& progress) {
    Stopwatch watch;
    std::unique_ptr<TailAlone<Segment>> tail;
    cancellable(progress, 0.95, [&](const detail::RayCaster::Progress& report) {
      detail::RayCaster::Cast cast = caster->begin(requestOf(prepared, settings, false, code));
      const Bands all{cast.height, cast.rowsPerBand};
      const std::uint64_t width = cast.build.width;
      tail = std::make_unique<TailAlone<Segment>>(*this, flight, width * cast.height);
      detail::ListDownload<Segment>& download = tail->download();
      const auto start = [&](std::size_t band) {
        Slot& slot = slotOf(band);
        const auto behind = [&download, &slot, first = all.first(band) * width](gpu::Commands& commands) {
          download.recordOffsets(commands, slot.lists, first);
        };
        caster->startBand(cast, all.first(band), all.last(band), slot.lists, behind, slot.usedBy);
      };
      start(0);
      for (std::size_t band = 0; band < all.count(); ++band) {
        if (band + 1 < all.count()) start(band + 1);
        caster->finishBand();
        slotOf(band).usedBy = download.send(slotOf(band).lists);
        if (!report(all.doneWith(band))) return caster->drop();
      }
      freeSlots(all.count());
    });
    mine.generateSeconds = watch.lap();
    noteTimes();
    return tail;
  }

  /// The same lists, band after band, into a file. With one rank. While the host encodes a band, the device
  /// makes the next one.
  template <typename Segment>
  void writeListsAlone(const Prepared& prepared, const GenerateSettings& settings, const DepthCode& code,
                       detail::VdiWriter<Segment>& writer, const Progress& progress) {
    Stopwatch watch;
    cancellable(progress, 0.95, [&](const detail::RayCaster::Progress& report) {
      detail::RayCaster::Cast cast = caster->begin(requestOf(prepared, settings, false, code));
      const Bands all{cast.height, cast.rowsPerBand};
      const auto start = [&](std::size_t band) {
        Slot& slot = slotOf(band);
        caster->startBand(cast, all.first(band), all.last(band), slot.lists, {}, slot.usedBy);
      };
      start(0);
      for (std::size_t band = 0; band < all.count(); ++band) {
        if (band + 1 < all.count()) start(band + 1);
        caster->finishBand();
        mine.subSupersegments += slotOf(band).lists.count;
        mine.generateSeconds += watch.lap();
        addBand(writer, std::uint64_t{all.first(band)} * cast.build.width, slotOf(band).lists);
        slotOf(band).usedBy = {};
        mine.outputSeconds += watch.lap();
        if (!report(all.doneWith(band))) return caster->drop();
      }
    });
    noteTimes();
  }

  /// Not collective.
  template <typename Segment>
  void addBand(detail::VdiWriter<Segment>& writer, std::uint64_t firstList,
               const detail::DeviceLists& lists) {
    if (lists.listCount > 0) writer.add(firstList, bandDownload->get<Segment>(lists));
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

  /// Who owns which of a band's lists: the same on all ranks. `weights`: what ranks agreed on, of the whole
  /// picture; none if they didn't.
  comm::Ownership ownershipOf(const detail::RayCaster::Cast& cast, const Bands& all, std::size_t band,
                              std::span<const std::uint32_t> weights) const {
    const std::uint64_t width = cast.build.width;
    const std::uint64_t lists = width * (all.last(band) - all.first(band));
    if (weights.empty()) return comm::Ownership::equal(lists, comm.size());
    const std::uint32_t stride = cast.build.countedStride;
    const std::size_t first = all.first(band) / stride;
    const std::size_t last = (all.last(band) + stride - 1) / stride;
    return comm::Ownership::balanced(lists, comm.size(), weights.subspan(first, last - first),
                                     width * stride);
  }

  /// What becomes of the lists that this rank owns, a band at a time.
  struct Sink {
    /// Submits what's made of a band that was merged by depth. Not collective.
    std::function<void(std::size_t band)> compose;
    /// Collective: waits for that, and sends it on.
    std::function<void(std::size_t band)> pass;
  };

  /// Collective: this rank's lists, band after band, to those who own them, where they're merged by depth.
  /// While a band is on its way, the device makes the next one.
  void makeOwnedBands(const Prepared& prepared, const GenerateSettings& settings, bool runsOnly,
                      const DepthCode& code, Flight& flight, const Progress& progress, const Sink& sink) {
    Stopwatch watch;
    detail::RayCaster::Cast cast;
    comm.together([&] { cast = caster->begin(requestOf(prepared, settings, runsOnly, code)); });
    std::array<double, 1> rows{static_cast<double>(cast.rowsPerBand)};
    comm.allReduceMin(rows);  // all ranks' bands are the same
    const Bands all{cast.height, static_cast<std::uint32_t>(rows[0])};
    agreeOnLists(cast);
    std::vector<std::uint32_t> weights;
    merged.resize(all.count());
    flight.owned.resize(all.count());
    const auto start = [&](std::size_t band) {
      Slot& slot = slotOf(band);
      slot.owned = ownershipOf(cast, all, band, weights);
      merged[band].firstList =
          std::uint64_t{all.first(band)} * cast.build.width + slot.owned.of(comm.rank()).first;
      const auto behind = [&slot](gpu::Commands& commands) {
        slot.distributor->recordPack(commands, slot.lists, slot.owned);
      };
      caster->startBand(cast, all.first(band), all.last(band), slot.lists, behind, slot.usedBy);
    };
    comm.together([&] {
      if (cast.agreed) weights = caster->agreedWeights(cast);
      start(0);
    });
    passOn();
    for (std::size_t band = 0; band < all.count(); ++band) {
      Slot& slot = slotOf(band);
      cancellable(progress, 0.8, [&](const detail::RayCaster::Progress& report) {
        if (band + 1 < all.count()) start(band + 1);
        caster->finishBand();
        report(all.doneWith(band));
      });
      mine.subSupersegments += slot.lists.count;
      mine.generateSeconds += watch.lap();
      slot.parts = slot.distributor->distribute(slot.lists, slot.owned, detail::segmentBytes(code));
      mine.bytesSent += slot.distributor->bytesSent();
      mine.distributeSeconds += watch.lap();
      if (band > 0) sink.pass(band - 1);
      comm.together([&] {
        compositor->interleave(slot.parts, code, merged[band].interleaved);
        sink.compose(band);
        slot.usedBy = compositor->last();
      });
      mine.compositeSeconds += watch.lap();
    }
    freeSlots(all.count());
    noteTimes();
  }

  /// With several ranks: the owners' lists, on their way to the root.
  template <typename Segment>
  class TailTogether final : public Tail {
   public:
    TailTogether(State& state, Flight& flight, const View& view)
        : s_(state),
          flight_(flight),
          gathered_(state.comm, root, state.pool, *flight.gather, *flight.downloads,
                    static_cast<std::uint64_t>(view.width()) * static_cast<std::uint64_t>(view.height())) {
      gathered_.begin(state.expectedSupersegments + state.expectedSupersegments / 8);
    }

    /// Collective.
    void pass(std::size_t band) {
      const detail::OwnedLists& own = flight_.owned[band];
      const std::vector<std::uint64_t> counts = s_.comm.gatherTogether([&] {
        s_.compositor->finish();
        return own.lists.count;
      });
      s_.comm.together([&] { gathered_.send(own, counts, band + 1 == flight_.owned.size()); });
      passed_ = band + 1;
    }
    void pass(RankReport& report) override {
      Stopwatch watch;
      if (passed_ < flight_.owned.size()) pass(passed_);
      report.compositeDeviceSeconds = 1e-3 * s_.compositor->takeMilliseconds();
      report.compositeSeconds += watch.lap();
    }
    void finish(Vdi& vdi, RankReport& report) override {
      Stopwatch watch;
      vdi.lists = gathered_.finish();
      s_.expectedSupersegments = gathered_.total();
      report.bytesSent += flight_.gather->bytesSent();
      report.gatherSeconds = watch.lap();
    }

   private:
    State& s_;
    Flight& flight_;
    detail::GatheredLists<Segment> gathered_;
    std::size_t passed_ = 0;  // bands
  };

  /// Collective, with a total budget: how many supersegments a list gets, the bands together tell.
  float levelOfAll(const GenerateSettings& settings, const detail::Compositor::Request& request) {
    SupersegmentHistogram histogram;
    comm.together([&] {
      for (const MergedBand& band : merged) histogram += compositor->histogram(band.interleaved, request);
    });
    comm.allReduceSum(histogram.supersegments);
    comm.allReduceSum(std::span(&histogram.equally, 1));
    return histogram.levelFor(settings.fill);
  }

  /// Collective: bands of the VDI's lists, on the devices of those who own them. `pass`: of a Sink. The last
  /// band isn't passed yet when this returns.
  void makeCompositedBands(const Prepared& prepared, const GenerateSettings& settings, const DepthCode& code,
                           Flight& flight, const Progress& progress,
                           const std::function<void(std::size_t band)>& pass) {
    detail::Compositor::Request request{settings.supersegments,
                                        maxPerList(settings.supersegments, settings.budget),
                                        prepared.lattice.step,
                                        settings.algorithm,
                                        code,
                                        -1.0F};
    const auto compose = [&](std::size_t band) {
      detail::OwnedLists& own = flight.owned[band];
      own.firstList = merged[band].firstList;
      compositor->composite(merged[band].interleaved, request, own.lists);
    };
    if (settings.budget == Budget::List)
      return makeOwnedBands(prepared, settings, false, code, flight, progress, {compose, pass});
    const auto nothing = [](std::size_t) {};
    makeOwnedBands(prepared, settings, false, code, flight, progress, {nothing, nothing});
    Stopwatch watch;
    request.level = levelOfAll(settings, request);
    for (std::size_t band = 0; band < merged.size(); ++band) {
      if (band > 0) pass(band - 1);
      comm.together([&] { compose(band); });
    }
    mine.compositeSeconds += watch.lap();
  }

  /// Collective: the VDI's lists, on their way to the root.
  template <typename Segment>
  std::unique_ptr<Tail> makeLists(const Prepared& prepared, const GenerateSettings& settings,
                                  const DepthCode& code, Flight& flight, const Progress& progress) {
    if (comm.size() == 1) return makeListsAlone<Segment>(prepared, settings, code, flight, progress);
    auto tail = std::make_unique<TailTogether<Segment>>(*this, flight, prepared.view);
    makeCompositedBands(prepared, settings, code, flight, progress,
                        [&](std::size_t band) { tail->pass(band); });
    return tail;
  }

  /// Collective: a VDI of `header`, in a file.
  template <typename Segment>
  WrittenVdi writeFile(const std::filesystem::path& path, const Vdi& header, const Prepared& prepared,
                       const GenerateSettings& settings, const Progress& progress) {
    detail::VdiWriter<Segment> writer(comm, root, path, header);
    Flight& flight = flights.front();
    if (comm.size() == 1) {
      writeListsAlone<Segment>(prepared, settings, header.depthCode, writer, progress);
    } else {
      // The device makes the band behind meanwhile.
      const auto add = [&](std::size_t band) {
        comm.together([&] {
          compositor->finish();
          Stopwatch output;
          addBand(writer, flight.owned[band].firstList, flight.owned[band].lists);
          mine.outputSeconds += output.lap();
        });
      };
      makeCompositedBands(prepared, settings, header.depthCode, flight, progress, add);
      mine.compositeSeconds -= mine.outputSeconds;  // of the bands that were added meanwhile
      add(flight.owned.size() - 1);
      mine.compositeDeviceSeconds = 1e-3 * compositor->takeMilliseconds();
    }
    Stopwatch watch;
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
    vdi.bounds = shown.scene.bounds;
    vdi.sampleStep = prepared.lattice.step;
    if (settings.precision == Precision::Compact) vdi.depthCode = depthCodeFor(prepared.lattice);
    return vdi;
  }

  /// Collective: the picture of all ranks' volumes, on the root. The limit case of the paper's section 5.3:
  /// one supersegment a run, composited in order of depth.
  Image renderTogether(const Prepared& prepared, const GenerateSettings& settings, const Progress& progress) {
    Image image;
    Flight& flight = flights.front();
    comm.together([&] {
      if (comm.rank() == root) image = imageIn(settings);
    });
    flight.gather->begin(*pool, std::array{std::as_writable_bytes(std::span(image.rgba)),
                                           std::as_writable_bytes(std::span(image.depth))});
    const auto flatten = [&](std::size_t band) {
      MergedBand& own = merged[band];
      compositor->flatten(own.interleaved, {}, own.colors, own.depths);
      own.flattened = compositor->last();
    };
    const auto send = [&](std::size_t band) {
      const MergedBand& own = merged[band];
      const std::uint64_t count = own.interleaved.listCount;
      const std::array pieces{
          detail::Gather::Piece{&own.colors, 0, own.firstList * sizeof(glm::vec4), count * sizeof(glm::vec4)},
          detail::Gather::Piece{&own.depths, 1, own.firstList * sizeof(float), count * sizeof(float)}};
      comm.together([&] {
        compositor->finish();
        flight.gather->send(pieces, own.flattened);
      });
    };
    makeOwnedBands(prepared, settings, true, {}, flight, progress, {flatten, send});
    Stopwatch watch;
    send(merged.size() - 1);
    mine.compositeDeviceSeconds = 1e-3 * compositor->takeMilliseconds();
    mine.compositeSeconds += watch.lap();
    flight.gather->finish();
    mine.bytesSent += flight.gather->bytesSent();
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
  std::optional<Vdi> vdi = finish(start(camera, transferFunction, settings, progress));
  if (progress) progress(1.0);
  return vdi;
}

VdiFrame VdiGenerator::start(const Camera& camera, const TransferFunction& transferFunction,
                             const GenerateSettings& settings, const Progress& progress) {
  State& s = *state_;
  const auto prepared = s.prepare(camera, transferFunction, settings);
  // Memory that a frame uses isn't replaced: one of another size waits for it.
  const auto kind =
      std::tuple(detail::fingerprintOf(settings), prepared->view.width(), prepared->view.height());
  if (s.lastKind != kind) s.completeAll();
  State::Flight& flight = s.freeFlight();
  s.lastKind = kind;
  flight.frame = std::make_shared<VdiFrame::State>();
  flight.frame->vdi = s.headerOf(*prepared, camera, settings);
  const DepthCode code = flight.frame->vdi.depthCode;
  flight.frame->tail = s.frame([&] {
    return code.step > 0.0F ? s.makeLists<CompactSupersegment>(*prepared, settings, code, flight, progress)
                            : s.makeLists<Supersegment>(*prepared, settings, code, flight, progress);
  });
  flight.frame->report = s.mine;
  return VdiFrame(flight.frame);
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
  Image image;
  if (s.comm.size() > 1) {
    image = s.frame([&] { return s.renderTogether(*prepared, settings, progress); });
  } else {
    Stopwatch watch;
    s.cancellable(progress, 0.95, [&](const detail::RayCaster::Progress& report) {
      image = s.imageIn(settings);
      s.caster->render(s.requestOf(*prepared, settings, false, {}), report, *s.pool, image);
    });
    s.mine.generateSeconds = watch.lap();
    s.noteTimes();
  }
  s.reports = s.gatherReports(s.mine);
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
