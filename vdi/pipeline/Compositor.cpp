#include "vdi/pipeline/Compositor.h"

#include <algorithm>
#include <utility>

#include "shaders/shared/counts.h"

namespace vdi::detail {

using gpu::MemoryKind;
namespace shared = gpu::shared;

Compositor::Compositor(std::shared_ptr<gpu::Device> device)
    : device_(std::move(device)),
      transfers_(device_, gpu::QueueKind::Transfer),
      commands_(device_),
      flattens_(device_),
      scan_(device_),
      counts_(device_, gpu::infoOf<shared::CountsConstants>("counts")),
      interleave_(device_, gpu::infoOf<shared::InterleaveConstants>("interleave")),
      compositePass_(device_),
      builder_(device_),
      histogram_(device_) {}

void Compositor::noteTimes() {
  for (const gpu::StageTime& stage : commands_.stageTimes()) milliseconds_ += stage.milliseconds;
}

/// Waits for the merge.
void Compositor::wait() {
  if (!std::exchange(merging_, false)) return;
  commands_.wait();
  for (HostAccess* access : receivedFrom_) access->finish();
  scan_.requireNoOverflow();
  noteTimes();
}

void Compositor::finish() {
  wait();
  if (std::exchange(building_, false)) {
    builder_.finish();
    milliseconds_ += builder_.times().all;
    last_ = builder_.last();
  }
  if (std::exchange(flattening_, false)) {
    flattens_.wait();
    for (const gpu::StageTime& stage : flattens_.stageTimes()) milliseconds_ += stage.milliseconds;
  }
}

void Compositor::drop() {
  transfers_.drop();
  commands_.drop();
  flattens_.drop();
  builder_.drop();
  merging_ = flattening_ = building_ = false;
}

double Compositor::takeMilliseconds() {
  return std::exchange(milliseconds_, 0.0);
}

/// Copies received lists, one rank after the other: supersegments to received_, and each rank's counts as a
/// row, either one byte each to packedCounts_ or one word each to wideCounts_.
void Compositor::receive(const Distributed& parts) {
  const std::uint64_t ranks = parts.subLists.size();
  const std::uint64_t rowWords = gpu::groupsFor(parts.listCount, shared::countsPerWord);
  const std::uint64_t rowLength = rowWords * shared::countsPerWord;
  received_.reserve(device_, parts.total * parts.segmentBytes, MemoryKind::DeviceLocal);
  packedCounts_.reserve(device_, ranks * rowWords * wordBytes, MemoryKind::DeviceLocal);
  const bool anyWide = std::ranges::any_of(parts.subLists, &SubLists::wideCounts);
  wideCounts_.reserve(device_, anyWide ? ranks * rowLength * wordBytes : 0, MemoryKind::DeviceLocal);
  const auto copy = [&](const SubLists& sub, const gpu::Buffer& own, std::uint64_t from,
                        const gpu::Buffer& to, std::uint64_t at, std::uint64_t bytes) {
    if (sub.access != nullptr) {
      sub.access->recordRead(transfers_, from, to, at, bytes);
    } else {
      transfers_.copy(own, from, to, at, bytes);
    }
  };
  transfers_.begin();
  transfers_.waitFor(parts.ownWritten);
  std::uint64_t received = 0;
  for (std::uint64_t r = 0; r < ranks; ++r) {
    const SubLists& sub = parts.subLists[r];
    copy(sub, *parts.ownSegments, sub.segmentsAt, received_, received, sub.count * parts.segmentBytes);
    received += sub.count * parts.segmentBytes;
    if (sub.wideCounts) {
      copy(sub, *parts.ownCounts, sub.countsAt, wideCounts_, r * rowLength * wordBytes,
           parts.listCount * wordBytes);
    } else {
      copy(sub, *parts.ownCounts, sub.countsAt, packedCounts_, r * rowWords * wordBytes,
           rowWords * wordBytes);
    }
  }
  transfers_.submit();
}

/// constants.mode is interleaveModeCount, then (after a scan) interleaveModeWrite, then interleaveModeFlatten
/// for a picture.
void Compositor::recordInterleave(gpu::Commands& commands, const shared::InterleaveConstants& constants) {
  commands.dispatch(interleave_.with({0, 0, constants.form.encoding}), constants,
                    gpu::groupsFor(constants.listCount, shared::compositeGroup));
}

/// Unpacks the received counts, and adds them up to each sub-list's place.
void Compositor::recordOffsets(const Distributed& parts) {
  const std::uint64_t ranks = parts.subLists.size();
  const std::uint64_t rowWords = gpu::groupsFor(parts.listCount, shared::countsPerWord);
  const std::uint64_t rowLength = rowWords * shared::countsPerWord;
  commands_.mark("unpack");
  shared::CountsConstants unpack{};
  unpack.packed = packedCounts_.address();
  unpack.counts = subCounts_.address();
  unpack.words = static_cast<std::uint32_t>(ranks * rowWords);
  unpack.mode = shared::countsModeUnpack;
  if (unpack.words > 0) commands_.dispatchMany(counts_, unpack, unpack.words, shared::countsGroup);
  commands_.barrier();
  for (std::uint64_t r = 0; r < ranks; ++r) {
    if (!parts.subLists[r].wideCounts) continue;
    // Counts after the row's last list must be 0.
    commands_.fill(subCounts_, r * rowLength * wordBytes, rowLength * wordBytes, 0);
    commands_.barrier();
    commands_.copy(wideCounts_, r * rowLength * wordBytes, subCounts_, r * rowLength * wordBytes,
                   parts.listCount * wordBytes);
  }
  scan_.record(commands_, subCounts_, subOffsets_, static_cast<std::uint32_t>(ranks * rowLength));
}

void Compositor::interleave(const Distributed& parts, const ListForm& form, DeviceLists& interleaved,
                            const ListBuilder::Behind& behind) {
  finish();
  const std::uint32_t lists = parts.listCount;
  const std::uint64_t ranks = parts.subLists.size();
  const std::uint64_t rowLength =
      std::uint64_t{gpu::groupsFor(lists, shared::countsPerWord)} * shared::countsPerWord;
  const std::uint64_t rows = ranks * rowLength;
  interleaved.listCount = lists;
  interleaved.count = parts.total;
  interleaved.offsets.reserve(device_, (std::uint64_t{lists} + 1) * wordBytes, MemoryKind::DeviceLocal);
  interleaved.segments.reserve(device_, parts.total * parts.segmentBytes, MemoryKind::DeviceLocal);
  subCounts_.reserve(device_, (rows + 1) * wordBytes, MemoryKind::DeviceLocal);
  subOffsets_.reserve(device_, (rows + 1) * wordBytes, MemoryKind::DeviceLocal);
  interleavedCounts_.reserve(device_, (std::uint64_t{lists} + 1) * wordBytes, MemoryKind::DeviceLocal);
  heads_.reserve(device_, parts.total * sizeof(shared::InterleaveHead), MemoryKind::DeviceLocal);
  receive(parts);

  commands_.begin();
  commands_.waitFor(transfers_);
  recordOffsets(parts);
  shared::InterleaveConstants constants{};
  constants.received = received_.address();
  constants.subOffsets = subOffsets_.address();
  constants.heads = heads_.address();
  constants.counts = interleavedCounts_.address();
  constants.offsets = interleaved.offsets.address();
  constants.interleaved = interleaved.segments.address();
  constants.listCount = lists;
  constants.rankCount = static_cast<std::uint32_t>(ranks);
  constants.rowLength = static_cast<std::uint32_t>(rowLength);
  constants.form = storedForm(form);
  commands_.mark("merge");
  constants.mode = shared::interleaveModeCount;
  if (lists > 0) recordInterleave(commands_, constants);
  scan_.record(commands_, interleavedCounts_, interleaved.offsets, lists);
  constants.mode = shared::interleaveModeWrite;
  if (lists > 0) recordInterleave(commands_, constants);
  if (behind) behind(commands_);
  commands_.submit();
  last_ = commands_.last();
  interleaved.written = last_;
  merging_ = true;
  receivedFrom_.clear();
  for (const SubLists& sub : parts.subLists) {
    if (sub.access != nullptr) receivedFrom_.push_back(sub.access);
  }
}

void Compositor::apply(const DeviceLists& interleaved, const Options& options) {
  settings_.step = static_cast<float>(options.sampleStep);
  settings_.budget = options.budget;
  settings_.maxPerList = options.maxPerList;
  settings_.level = options.level;
  settings_.form = storedForm(options.form);
  settings_.interleaved = interleaved.segments.address();
  settings_.interleavedOffsets = interleaved.offsets.address();
  settings_.listCount = interleaved.listCount;
}

SupersegmentHistogram Compositor::histogram(const DeviceLists& interleaved, const Options& options) {
  finish();
  if (interleaved.listCount == 0) return {};
  apply(interleaved, options);
  const SupersegmentHistogram histogram =
      histogram_.take(commands_, [&](gpu::Commands& commands, std::uint64_t address) {
        settings_.histogram = address;
        compositePass_.record(commands, settings_, gpu::CompositePass::Work::Histogram, options.algorithm);
      });
  noteTimes();
  return histogram;
}

void Compositor::composite(const DeviceLists& interleaved, const Options& options, DeviceLists& lists) {
  lists.offsets.reserve(device_, (std::uint64_t{interleaved.listCount} + 1) * wordBytes,
                        MemoryKind::DeviceLocal);
  lists.segments.reserve(device_, 0, MemoryKind::DeviceLocal);
  lists.listCount = interleaved.listCount;
  lists.count = 0;
  lists.written = {};
  if (interleaved.listCount == 0) return;
  apply(interleaved, options);
  const auto record = [this, settings = settings_, algorithm = options.algorithm](
                          gpu::Commands& commands, const BandTargets& targets, bool write) {
    shared::CompositeParams params = settings;
    params.thresholds = targets.thresholds;
    params.capacities = targets.capacities;
    params.offsets = targets.offsets;
    params.segments = targets.segments;
    params.preSegments = targets.preSegments;
    params.written = targets.written;
    params.left = targets.left;
    params.status = targets.status;
    params.guard = targets.guard;
    using Work = gpu::CompositePass::Work;
    compositePass_.record(commands, params, write ? Work::Write : Work::Count, algorithm);
  };
  ListBuilder::Options build;
  build.width = interleaved.listCount;
  build.rows = 1;
  build.algorithm = options.algorithm;
  build.maxPerList = {options.maxPerList, true};
  build.sampleStep = options.sampleStep;
  build.form = options.form;
  build.fitting = interleaved.segments.address();
  build.fittingOffsets = interleaved.offsets.address();
  builder_.start(build, record, lists);
  building_ = true;
  last_ = builder_.last();
}

void Compositor::flatten(const DeviceLists& interleaved, const ListForm& form, gpu::Buffer& colors,
                         gpu::Buffer& depths) {
  colors.reserve(device_, interleaved.listCount * sizeof(glm::vec4), MemoryKind::DeviceLocal);
  depths.reserve(device_, interleaved.listCount * sizeof(float), MemoryKind::DeviceLocal);
  if (interleaved.listCount == 0) return;
  shared::InterleaveConstants constants{};
  constants.offsets = interleaved.offsets.address();
  constants.interleaved = interleaved.segments.address();
  constants.colors = colors.address();
  constants.depths = depths.address();
  constants.listCount = interleaved.listCount;
  constants.mode = shared::interleaveModeFlatten;
  constants.form = storedForm(form);
  flattens_.begin();
  flattens_.mark("flatten");
  recordInterleave(flattens_, constants);
  flattens_.submit();
  flattening_ = true;
  last_ = flattens_.last();
}

}  // namespace vdi::detail
