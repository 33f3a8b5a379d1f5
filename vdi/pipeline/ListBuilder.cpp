#include "vdi/pipeline/ListBuilder.h"

#include <fmt/format.h>

#include <bit>
#include <cassert>
#include <limits>
#include <utility>

#include "shaders/shared/interpolate.h"
#include "vdi/core/BitCast.h"
#include "vdi/core/Error.h"

namespace vdi::detail {

using gpu::MemoryKind;
namespace shared = gpu::shared;

ListBuilder::ListBuilder(std::shared_ptr<gpu::Device> device)
    : device_(std::move(device)),
      commands_(device_),
      scan_(device_),
      interpolate_(device_, gpu::infoOf<shared::InterpolateConstants>("interpolate")),
      reduce_(device_),
      status_(device_, shared::statusWords * sizeof(std::uint32_t), MemoryKind::DeviceLocal),
      statusReadback_(device_, shared::statusWords * sizeof(std::uint32_t), MemoryKind::Readback),
      preSegmentsFit_(device_, sizeof(std::uint32_t), MemoryKind::DeviceLocal),
      segmentsFit_(device_, sizeof(std::uint32_t), MemoryKind::DeviceLocal),
      totals_(device_, 2 * sizeof(std::uint32_t), MemoryKind::Readback) {}

shared::StoredForm storedForm(const ListForm& form) {
  return {form.code.first, form.code.step, static_cast<std::uint32_t>(form.precision)};
}

std::uint64_t ListBuilder::bytesPerList(std::uint32_t maxCount, Algorithm algorithm) {
  const std::uint64_t segments = std::uint64_t{maxCount} * sizeof(Supersegment);
  if (algorithm == Algorithm::Bisection) return segments;
  return segments + shared::maxPreSegments(maxCount) * sizeof(shared::StoredPreSegment);
}

/// Reserves memory; this host work may overlap the device's work for another builder.
void ListBuilder::reserve() {
  const Options& options = started_->options;
  DeviceLists& lists = *started_->lists;
  const std::uint64_t words = (std::uint64_t{options.listCount()} + 1) * sizeof(std::uint32_t);
  thresholds_.reserve(device_, words, MemoryKind::DeviceLocal);
  capacities_.reserve(device_, words, MemoryKind::DeviceLocal);
  lists.offsets.reserve(device_, words, MemoryKind::DeviceLocal);
  lists.listCount = options.listCount();
  times_ = {};
  if (options.algorithm == Algorithm::Bisection) return;
  const std::uint64_t countedWords =
      std::uint64_t{options.countedWidth()} * options.countedRows() * sizeof(std::uint32_t);
  preSegmentOffsets_.reserve(device_, words, MemoryKind::DeviceLocal);
  written_.reserve(device_, words, MemoryKind::DeviceLocal);
  countedTolerances_.reserve(device_, countedWords, MemoryKind::DeviceLocal);
  countedPreSegments_.reserve(device_, countedWords, MemoryKind::DeviceLocal);
  left_.reserve(device_, words, MemoryKind::DeviceLocal);
  preSegments_.reserve(device_, 0, MemoryKind::DeviceLocal);
  lists.segments.reserve(device_, 0, MemoryKind::DeviceLocal);
  if (hasQuotas()) quotas_.reserve(device_, words, MemoryKind::DeviceLocal);
}

void ListBuilder::start(const Options& options, Record record, DeviceLists& lists, Behind behind,
                        const gpu::Submission& after) {
  commands_.wait();
  started_ = Started{options, std::move(record), std::move(behind), &lists};
  reserve();
  if (options.algorithm == Algorithm::Bisection) {
    submitBisection(after);
  } else {
    submitMerging(From::Search, after);
  }
}

void ListBuilder::startEmpty(std::uint32_t listCount, DeviceLists& lists, const Behind& behind) {
  commands_.wait();
  started_ = Started{{}, {}, behind, &lists, true};
  lists.offsets.reserve(device_, (std::uint64_t{listCount} + 1) * sizeof(std::uint32_t),
                        MemoryKind::DeviceLocal);
  lists.segments.reserve(device_, 0, MemoryKind::DeviceLocal);
  lists.listCount = listCount;
  times_ = {};
  commands_.begin();
  commands_.fill(status_, 0);
  commands_.fill(lists.offsets, 0);
  commands_.barrier();
  submit();
}

void ListBuilder::finish() {
  assert(started_);
  if (started_->empty) {
    commands_.wait();
    started_->lists->count = 0;
  } else if (started_->options.algorithm == Algorithm::Bisection) {
    finishBisection();
  } else {
    finishMerging();
  }
  started_->lists->written = commands_.last();
  started_.reset();
  if (const std::uint32_t wrong = statusReadback_.mappedAs<std::uint32_t>()[shared::statusWrongLists];
      wrong != 0) {
    throw Error(ErrorCode::DeviceFailure,
                fmt::format("{} lists have a written count that differs from the stored one", wrong),
                device_->name());
  }
}

void ListBuilder::drop() {
  commands_.drop();
  started_.reset();
}

/// Submits the steps, the download of their status, and the work of `behind`.
void ListBuilder::submit() {
  commands_.copy(status_, 0, statusReadback_, 0, statusReadback_.size());
  if (started_->behind) started_->behind(commands_);
  commands_.submit();
}

/// Adds the times of the completed submission.
void ListBuilder::addTimes() {
  for (const gpu::StageTime& stage : commands_.stageTimes()) {
    times_.all += stage.milliseconds;
    if (stage.name == "count") times_.count += stage.milliseconds;
    if (stage.name == "write") times_.write += stage.milliseconds;
  }
}

constexpr std::size_t preSegmentTotal = 0;
constexpr std::size_t segmentTotal = 1;

/// Copies the last offset to totals_.
void ListBuilder::recordTotal(const gpu::Buffer& offsets, std::uint32_t listCount, std::size_t which) {
  commands_.copy(offsets, std::uint64_t{listCount} * sizeof(std::uint32_t), totals_,
                 which * sizeof(std::uint32_t), sizeof(std::uint32_t));
}

/// Submits only the search, because the host must allocate memory before anything is written.
void ListBuilder::submitBisection(const gpu::Submission& after) {
  const std::uint32_t listCount = started_->options.listCount();
  DeviceLists& lists = *started_->lists;
  BandTargets targets;
  targets.thresholds = thresholds_.address();
  targets.capacities = capacities_.address();
  targets.offsets = lists.offsets.address();
  targets.status = status_.address();
  commands_.begin();
  commands_.waitFor(after);
  commands_.mark("count");
  started_->record(commands_, targets, false);
  scan_.record(commands_, capacities_, lists.offsets, listCount);
  recordTotal(lists.offsets, listCount, segmentTotal);
  commands_.submit();
}

void ListBuilder::finishBisection() {
  const Options& options = started_->options;
  DeviceLists& lists = *started_->lists;
  commands_.wait();
  addTimes();
  scan_.requireNoOverflow();
  lists.count = totals_.mappedAs<std::uint32_t>()[segmentTotal];
  lists.segments.reserve(device_, lists.count * segmentBytes(options.form.precision),
                         MemoryKind::DeviceLocal);
  BandTargets targets;
  targets.thresholds = thresholds_.address();
  targets.capacities = capacities_.address();
  targets.offsets = lists.offsets.address();
  targets.segments = lists.segments.address();
  targets.status = status_.address();
  commands_.begin();
  commands_.fill(status_, 0);
  commands_.barrier();
  commands_.mark("write");
  if (lists.count > 0) started_->record(commands_, targets, true);
  commands_.barrier();
  submit();
  commands_.wait();
  addTimes();
}

/// Finds tolerances and capacities of all lists.
void ListBuilder::recordSearch() {
  const Options& options = started_->options;
  if (options.runsOnly) {
    commands_.fill(thresholds_, bit_cast<std::uint32_t>(std::numeric_limits<float>::max()));
    commands_.fill(capacities_, expectedRuns_);
    commands_.fill(quotas_, expectedRuns_ << 16U);
    return;
  }
  shared::InterpolateConstants constants{};
  constants.countedTolerances = countedTolerances_.address();
  constants.countedPreSegments = countedPreSegments_.address();
  constants.tolerances = thresholds_.address();
  constants.capacities = capacities_.address();
  constants.width = options.width;
  constants.rows = options.rows;
  constants.countedWidth = options.countedWidth();
  constants.countedRows = options.countedRows();
  constants.strideShift = static_cast<std::uint32_t>(std::countr_zero(options.countedStride));
  commands_.mark("count");
  if (options.agreed) {
    constants.countedTolerances = options.agreed->tolerances;
    constants.countedPreSegments = options.agreed->preSegments;
    constants.countedQuotas = options.agreed->quotas;
    constants.quotas = quotas_.address();
    constants.budget = options.agreed->budget;
  } else {
    BandTargets targets;
    targets.thresholds = countedTolerances_.address();
    targets.capacities = countedPreSegments_.address();
    targets.status = status_.address();
    targets.guard = preSegmentsFit_.address();
    started_->record(commands_, targets, false);
    commands_.barrier();
  }
  commands_.dispatch(interpolate_.with({constants.quotas != 0 ? 1U : 0U}), constants,
                     gpu::groupsFor(constants.width, shared::interpolateGroup), constants.rows);
}

/// Writes pre-segments, and the number of supersegments to keep of them.
void ListBuilder::recordWrite() {
  const Options& options = started_->options;
  const std::uint32_t listCount = options.listCount();
  DeviceLists& lists = *started_->lists;
  BandTargets targets;
  targets.thresholds = thresholds_.address();
  targets.capacities = capacities_.address();
  targets.offsets = preSegmentOffsets_.address();
  targets.preSegments = preSegments_.address();
  targets.written = written_.address();
  targets.left = left_.address();
  targets.quotas = hasQuotas() ? quotas_.address() : 0;
  targets.status = status_.address();
  targets.guard = preSegmentsFit_.address();
  scan_.record(commands_, capacities_, preSegmentOffsets_, listCount, preSegmentsFit_,
               preSegments_.size() / sizeof(shared::StoredPreSegment));
  commands_.mark("write");
  started_->record(commands_, targets, true);
  scan_.record(commands_, left_, lists.offsets, listCount, segmentsFit_,
               lists.segments.size() / segmentBytes(options.form.precision), &preSegmentsFit_);
  recordTotal(preSegmentOffsets_, listCount, preSegmentTotal);
  recordTotal(lists.offsets, listCount, segmentTotal);
}

void ListBuilder::recordReduce() {
  const Options& options = started_->options;
  const DeviceLists& lists = *started_->lists;
  shared::ReduceConstants constants{};
  constants.preSegments = preSegments_.address();
  constants.preSegmentOffsets = preSegmentOffsets_.address();
  constants.written = written_.address();
  constants.left = left_.address();
  constants.offsets = lists.offsets.address();
  constants.segments = lists.segments.address();
  constants.fitting = options.fitting;
  constants.fittingOffsets = options.fittingOffsets;
  constants.guard = segmentsFit_.address();
  constants.step = static_cast<float>(options.sampleStep);
  constants.listCount = options.listCount();
  constants.form = storedForm(options.form);
  commands_.mark("reduce");
  reduce_.record(commands_, constants, options.maxPerList);
}

/// Submits all steps at once. They use the previous frame's memory for pre-segments and supersegments; if
/// it is too small, the steps that need it do nothing.
void ListBuilder::submitMerging(From from, const gpu::Submission& after) {
  commands_.begin();
  commands_.waitFor(after);
  if (from != From::Reduce) {
    commands_.fill(status_, 0);
    commands_.barrier();
  }
  if (from == From::Search) recordSearch();
  if (from != From::Reduce) recordWrite();
  if (from == From::Reduce) commands_.fill(segmentsFit_, 1);
  commands_.barrier();
  recordReduce();
  commands_.barrier();
  submit();
}

/// The runs to expect in each list of the next pictures, after a list had `most` of them: a quarter more, as
/// far as memory allows.
std::uint32_t ListBuilder::runsToExpect(std::uint32_t most) const {
  constexpr std::uint64_t atLeast = 8;
  const std::uint64_t perRun =
      std::uint64_t{started_->options.listCount()} * sizeof(shared::StoredPreSegment);
  const std::uint64_t room = device_->limits().memoryBytes / 16 / perRun;
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(most + most / 4, std::max(room, atLeast)));
}

/// Returns the step from which to submit again, if any. Allocates a quarter more than the counted numbers.
std::optional<ListBuilder::From> ListBuilder::againFrom(From from) {
  const Options& options = started_->options;
  DeviceLists& lists = *started_->lists;
  const auto totals = totals_.mappedAs<std::uint32_t>();
  const auto status = statusReadback_.mappedAs<std::uint32_t>();
  const std::uint64_t preSegmentBytes = totals[preSegmentTotal] * sizeof(shared::StoredPreSegment);
  const std::uint64_t listBytes = totals[segmentTotal] * segmentBytes(options.form.precision);
  if (preSegments_.size() < preSegmentBytes) {
    preSegments_.reserve(device_, preSegmentBytes + preSegmentBytes / 4, MemoryKind::DeviceLocal);
    return From::Write;
  }
  if (hasQuotas() && status[shared::statusWrongLists] != 0 && from != From::Reduce) {
    // Lists that were not counted may have more runs than expected. They have reported their number.
    if (options.runsOnly)
      expectedRuns_ = std::max(expectedRuns_, runsToExpect(status[shared::statusMostRuns]));
    return From::Write;
  }
  scan_.requireNoOverflow();
  if (lists.segments.size() < listBytes) {
    lists.segments.reserve(device_, listBytes + listBytes / 4, MemoryKind::DeviceLocal);
    return From::Reduce;
  }
  return std::nullopt;
}

void ListBuilder::finishMerging() {
  for (std::optional<From> from = From::Search; from;) {
    commands_.wait();
    addTimes();
    from = againFrom(*from);
    started_->lists->count = totals_.mappedAs<std::uint32_t>()[segmentTotal];
    if (from) submitMerging(*from, {});
  }
}

}  // namespace vdi::detail
