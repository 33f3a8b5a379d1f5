#include "vdi/pipeline/BandMaker.h"

namespace vdi::detail {

BandMaker::BandMaker(const std::shared_ptr<gpu::Device>& device, const comm::Communicator& comm,
                     const GeneratorOptions& options)
    : comm_(comm),
      caster_(device, options.bands),
      compositor_(device),
      levelSum_(comm, options.transport),
      accesses_(device) {
  for (Slot& slot : slots_) slot.distributor = std::make_unique<Distributor>(device, comm, options.transport);
}

void BandMaker::drop() noexcept {
  caster_.drop();
  for (Slot& slot : slots_) slot.distributor->drop();
  compositor_.drop();
}

void BandMaker::noteTimes(RankReport& report) const {
  report.generateDeviceSeconds = 1e-3 * caster_.times().all;
  report.countSeconds = 1e-3 * caster_.times().count;
  report.writeSeconds = 1e-3 * caster_.times().write;
}

void BandMaker::makeAlone(const RayCaster::Inputs& inputs, const Progress& progress, VdiSink& sink,
                          RankReport& report) {
  Stopwatch watch;
  cancellable(comm_, progress, 0.95, [&](const RayCaster::Progress& advanced) {
    RayCaster::Cast cast = caster_.begin(inputs);
    const Bands all{cast.height, cast.rowsPerBand};
    const auto firstList = [&](std::size_t band) {
      return std::uint64_t{all.first(band)} * cast.build.width;
    };
    const auto start = [&](std::size_t band) {
      Slot& slot = slotOf(band);
      const auto behind = [&sink, &slot, first = firstList(band)](gpu::Commands& commands) {
        sink.record(commands, slot.lists, first);
      };
      caster_.startBand(cast, all.first(band), all.last(band), slot.lists, behind, slot.usedBy);
    };
    start(0);
    for (std::size_t band = 0; band < all.count(); ++band) {
      if (band + 1 < all.count()) start(band + 1);
      caster_.finishBand();
      Slot& slot = slotOf(band);
      report.subSupersegments += slot.lists.count;
      report.generateSeconds += watch.lap();
      slot.usedBy = sink.add(
          {slot.lists, firstList(band), band + 1 == all.count()}, [] {}, report);
      watch.lap();  // excludes the sink's own time
      if (!advanced(all.doneWith(band))) return caster_.drop();
    }
    freeSlots(all.count());
  });
  noteTimes(report);
}

/// Collective: agrees on one tolerance for all ranks' material in each list.
void BandMaker::agreeOnLists(RayCaster::Cast& cast) {
  if (!cast.agreed) return;
  const comm::Exchange::Place own = levelSum_.begin(RayCaster::levelBytes(cast));
  comm_.together([&] {
    accesses_.tidy();
    caster_.countLevels(cast, accesses_.of(own.memory), own.at);
  });
  const std::span<const comm::ByteSum::Stretch> stretches = levelSum_.add();
  comm_.together([&] {
    std::vector<RayCaster::LevelSum> sum;
    for (const comm::ByteSum::Stretch& stretch : stretches)
      sum.push_back({&accesses_.of(stretch.place.memory), stretch.place.at, stretch.first, stretch.bytes});
    caster_.takeLevelSum(cast, sum);
  });
}

/// The owners of a band's lists, equal on all ranks. `weights` are the ranks' agreed weights of the whole
/// picture, or empty.
comm::Ownership BandMaker::ownershipOf(const RayCaster::Cast& cast, const Bands& all, std::size_t band,
                                       std::span<const std::uint32_t> weights) const {
  const std::uint64_t width = cast.build.width;
  const std::uint64_t lists = width * (all.last(band) - all.first(band));
  if (weights.empty()) return comm::Ownership::equal(lists, comm_.size());
  const std::uint32_t stride = cast.build.countedStride;
  const std::size_t first = all.first(band) / stride;
  const std::size_t last = (all.last(band) + stride - 1) / stride;
  return comm::Ownership::balanced(lists, comm_.size(), weights.subspan(first, last - first), width * stride);
}

/// Collective: sends this rank's lists to their owners.
void BandMaker::distribute(Slot& slot, Precision precision, Stopwatch& watch, RankReport& report) {
  slot.parts = slot.distributor->distribute(slot.lists, slot.owned, segmentBytes(precision));
  report.bytesSent += slot.distributor->bytesSent();
  report.distributeSeconds += watch.lap();
}

void BandMaker::makeOwned(const RayCaster::Inputs& inputs, const Progress& progress, const OwnedSteps& steps,
                          RankReport& report) {
  Stopwatch watch;
  RayCaster::Cast cast;
  comm_.together([&] { cast = caster_.begin(inputs); });
  std::array<double, 1> rows{static_cast<double>(cast.rowsPerBand)};
  comm_.allReduceMin(rows);  // all ranks use the same bands
  const Bands all{cast.height, static_cast<std::uint32_t>(rows[0])};
  agreeOnLists(cast);
  std::vector<std::uint32_t> weights;
  const auto start = [&](std::size_t band) {
    Slot& slot = slotOf(band);
    slot.owned = ownershipOf(cast, all, band, weights);
    merged_[band].firstList =
        std::uint64_t{all.first(band)} * cast.build.width + slot.owned.of(comm_.rank()).first;
    const auto behind = [this, &slot](gpu::Commands& commands) {
      slot.distributor->recordPack(commands, slot.lists, slot.owned);
    };
    caster_.startBand(cast, all.first(band), all.last(band), slot.lists, behind, slot.usedBy);
  };
  comm_.together([&] {
    merged_.resize(all.count());
    if (cast.agreed) weights = caster_.agreedWeights(cast);
    start(0);
  });
  steps.started();
  for (std::size_t band = 0; band < all.count(); ++band) {
    Slot& slot = slotOf(band);
    cancellable(comm_, progress, 0.8, [&](const RayCaster::Progress& advanced) {
      if (band + 1 < all.count()) start(band + 1);
      caster_.finishBand();
      advanced(all.doneWith(band));
    });
    report.subSupersegments += slot.lists.count;
    report.generateSeconds += watch.lap();
    distribute(slot, inputs.form.precision, watch, report);
    if (band > 0) {
      steps.pass(band - 1);
      watch.lap();  // excludes the step's own time
    }
    comm_.together([&] {
      compositor_.interleave(slot.parts, inputs.form, merged_[band].interleaved);
      steps.compose(band);
      slot.usedBy = compositor_.last();
    });
    report.compositeSeconds += watch.lap();
  }
  freeSlots(all.count());
  noteTimes(report);
}

/// Collective, with a total budget: the level that limits each list, from the histogram of all bands.
float BandMaker::levelOfAll(const GenerateSettings& settings, const Compositor::Options& options) {
  SupersegmentHistogram histogram;
  comm_.together([&] {
    for (const MergedBand& band : merged_) histogram += compositor_.histogram(band.interleaved, options);
  });
  comm_.allReduceSum(histogram.supersegments);
  comm_.allReduceSum(std::span(&histogram.equally, 1));
  return histogram.levelFor(settings.fill);
}

void BandMaker::add(const std::vector<OwnedLists>& owned, std::size_t band, VdiSink& sink,
                    RankReport& report) {
  const OwnedLists& own = owned[band];
  sink.add(
      {own.lists, own.firstList, band + 1 == owned.size()}, [this] { compositor_.finish(); }, report);
}

void BandMaker::addLast(const std::vector<OwnedLists>& owned, VdiSink& sink, RankReport& report) {
  add(owned, owned.size() - 1, sink, report);
  report.compositeDeviceSeconds = 1e-3 * compositor_.takeMilliseconds();
}

void BandMaker::makeComposited(const RayCaster::Inputs& inputs, const Progress& progress,
                               std::vector<OwnedLists>& owned, FunctionRef<void()> started, VdiSink& sink,
                               RankReport& report) {
  const GenerateSettings& settings = inputs.settings;
  Compositor::Options composite{settings.supersegments,
                                maxPerList(settings.supersegments, settings.budget),
                                inputs.lattice.step,
                                settings.algorithm,
                                inputs.form,
                                -1.0F};
  const auto compose = [&](std::size_t band) {
    owned.resize(merged_.size());
    owned[band].firstList = merged_[band].firstList;
    compositor_.composite(merged_[band].interleaved, composite, owned[band].lists);
  };
  const auto pass = [&](std::size_t band) { add(owned, band, sink, report); };
  if (settings.budget == Budget::List) return makeOwned(inputs, progress, {started, compose, pass}, report);
  const auto nothing = [](std::size_t) {};
  makeOwned(inputs, progress, {started, nothing, nothing}, report);
  Stopwatch watch;
  composite.level = levelOfAll(settings, composite);
  for (std::size_t band = 0; band < merged_.size(); ++band) {
    report.compositeSeconds += watch.lap();
    if (band > 0) pass(band - 1);
    watch.lap();
    comm_.together([&] { compose(band); });
  }
  report.compositeSeconds += watch.lap();
}

void BandMaker::makeFlat(const RayCaster::Inputs& inputs, const Progress& progress,
                         std::vector<FlatBand>& flat, FunctionRef<void(std::size_t band)> pass,
                         RankReport& report) {
  const auto flatten = [&](std::size_t band) {
    flat.resize(merged_.size());
    FlatBand& own = flat[band];
    own.firstPixel = merged_[band].firstList;
    own.pixelCount = merged_[band].interleaved.listCount;
    compositor_.flatten(merged_[band].interleaved, {}, own.colors, own.depths);
    own.flattened = compositor_.last();
  };
  const auto started = [] {};
  makeOwned(inputs, progress, {started, flatten, pass}, report);
}

void BandMaker::render(const RayCaster::Inputs& inputs, const Progress& progress, HostPool& pool,
                       Image& image, RankReport& report) {
  Stopwatch watch;
  cancellable(comm_, progress, 0.95,
              [&](const RayCaster::Progress& advanced) { caster_.render(inputs, advanced, pool, image); });
  report.generateSeconds = watch.lap();
  noteTimes(report);
}

void BandMaker::project(const RayCaster::Inputs& inputs, const Progress& progress, HostPool& pool,
                        HostVector<std::uint64_t>& keys, RankReport& report) {
  Stopwatch watch;
  cancellable(comm_, progress, 0.95,
              [&](const RayCaster::Progress& advanced) { caster_.project(inputs, advanced, pool, keys); });
  report.generateSeconds = watch.lap();
  noteTimes(report);
}

}  // namespace vdi::detail
