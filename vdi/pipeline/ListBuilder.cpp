#include "vdi/pipeline/ListBuilder.h"

#include <fmt/format.h>

#include <bit>
#include <limits>

#include "vdi/core/Error.h"

namespace vdi::detail {

using gpu::MemoryKind;
namespace shared = gpu::shared;

ListBuilder::ListBuilder(std::shared_ptr<gpu::Device> device)
    : device_(std::move(device)),
      commands_(device_),
      scan_(device_),
      allot_(device_),
      reduce_(device_),
      status_(device_, sizeof(std::uint32_t), MemoryKind::Readback) {}

shared::StoredForm storedForm(const DepthCode& code) {
  return {code.first, code.step};
}

std::uint64_t ListBuilder::bytesPerList(std::uint32_t most, Algorithm algorithm) {
  const std::uint64_t segments = std::uint64_t{most} * sizeof(Supersegment);
  if (algorithm == Algorithm::Bisection) return segments;
  return segments + shared::mostGrains(most) * sizeof(shared::StoredGrain);
}

template <typename Segment>
void ListBuilder::build(const Request& request, const Record& record, ListsOf<Segment>& result) {
  const std::uint64_t words = (std::uint64_t{request.listCount()} + 1) * sizeof(std::uint32_t);
  sensitivities_.reserve(device_, words, MemoryKind::DeviceLocal);
  counts_.reserve(device_, words, MemoryKind::DeviceLocal);
  offsets_.reserve(device_, words, MemoryKind::DeviceLocal);
  readback_.reserve(device_, words, MemoryKind::Readback);
  status_.mappedAs<std::uint32_t>()[0] = 0;
  times_ = {};
  if (request.algorithm == Algorithm::Bisection) {
    buildByBisection(request, record, result);
  } else {
    buildByMerging(request, record, result);
  }
  if (const std::uint32_t wrong = status_.mappedAs<std::uint32_t>()[0]; wrong != 0) {
    throw Error(ErrorCode::DeviceFailure,
                fmt::format("{} lists were written with another count than was stored", wrong),
                device_->name());
  }
}

void ListBuilder::submit() {
  commands_.submitAndWait();
  for (const gpu::StageTime& stage : commands_.stageTimes()) {
    if (stage.name == "download") continue;
    times_.all += stage.milliseconds;
    if (stage.name == "search") times_.search += stage.milliseconds;
    if (stage.name == "write") times_.write += stage.milliseconds;
  }
}

/// Ends the recording with the prefix sum of counts, submits, and returns the sum of all; the offsets are in
/// readback_.
std::uint64_t ListBuilder::scanAndTotal(std::uint32_t listCount, const gpu::Buffer& counts,
                                        gpu::Buffer& offsets) {
  const std::uint64_t words = (std::uint64_t{listCount} + 1) * sizeof(std::uint32_t);
  scan_.record(commands_, counts, offsets, listCount);
  commands_.mark("download");
  commands_.copy(offsets, 0, readback_, 0, words);
  submit();
  scan_.demandNoOverflow();
  return readback_.mappedAs<std::uint32_t>()[listCount];
}

template <typename Segment>
void ListBuilder::appendOffsets(std::uint32_t listCount, ListsOf<Segment>& result) const {
  const auto offsets = readback_.mappedAs<std::uint32_t>();
  const std::uint64_t before = result.segments.size();
  if (before + offsets[listCount] > std::numeric_limits<std::uint32_t>::max()) {
    throw Error(ErrorCode::OutOfMemory, "more than 2^32 supersegments in one VDI", device_->name());
  }
  for (std::uint32_t i = 1; i <= listCount; ++i) {
    result.offsets.push_back(static_cast<std::uint32_t>(before + offsets[i]));
  }
}

/// Ends the recording with the copy of the supersegments, submits and appends them.
template <typename Segment>
void ListBuilder::download(std::uint64_t total, ListsOf<Segment>& result) {
  const std::uint64_t bytes = total * sizeof(Segment);
  readback_.reserve(device_, bytes, MemoryKind::Readback);
  commands_.barrier();
  commands_.mark("download");
  commands_.copy(segments_, 0, readback_, 0, bytes);
  submit();
  const auto written = readback_.mappedAs<Segment>().first(total);
  result.segments.insert(result.segments.end(), written.begin(), written.end());
}

template <typename Segment>
void ListBuilder::buildByBisection(const Request& request, const Record& record, ListsOf<Segment>& result) {
  BandTargets targets;
  targets.sensitivities = sensitivities_.address();
  targets.counts = counts_.address();
  targets.offsets = offsets_.address();
  targets.status = status_.address();
  commands_.begin();
  commands_.mark("search");
  record(commands_, targets, false);
  const std::uint64_t total = scanAndTotal(request.listCount(), counts_, offsets_);
  appendOffsets(request.listCount(), result);
  if (total == 0) return;

  segments_.reserve(device_, total * sizeof(Segment), MemoryKind::DeviceLocal);
  targets.segments = segments_.address();
  commands_.begin();
  commands_.mark("write");
  record(commands_, targets, true);
  download(total, result);
}

template <typename Segment>
void ListBuilder::buildByMerging(const Request& request, const Record& record, ListsOf<Segment>& result) {
  const std::uint32_t lists = request.listCount();
  const std::uint64_t words = (std::uint64_t{lists} + 1) * sizeof(std::uint32_t);
  const std::uint64_t countedWords =
      std::uint64_t{request.countedWidth()} * request.countedRows() * sizeof(std::uint32_t);
  grainOffsets_.reserve(device_, words, MemoryKind::DeviceLocal);
  written_.reserve(device_, words, MemoryKind::DeviceLocal);
  countedTolerances_.reserve(device_, countedWords, MemoryKind::DeviceLocal);
  countedGrains_.reserve(device_, countedWords, MemoryKind::DeviceLocal);
  left_.reserve(device_, words, MemoryKind::DeviceLocal);
  BandTargets targets;
  targets.sensitivities = countedTolerances_.address();
  targets.counts = countedGrains_.address();
  targets.status = status_.address();
  commands_.begin();
  commands_.mark("search");
  record(commands_, targets, false);
  commands_.barrier();
  allot_.record(commands_,
                {countedTolerances_.address(), countedGrains_.address(), sensitivities_.address(),
                 counts_.address(), request.width, request.rows, request.countedWidth(),
                 request.countedRows(), static_cast<std::uint32_t>(std::countr_zero(request.countedStride))});
  const std::uint64_t grainTotal = scanAndTotal(lists, counts_, grainOffsets_);

  grains_.reserve(device_, grainTotal * sizeof(shared::StoredGrain), MemoryKind::DeviceLocal);
  targets.sensitivities = sensitivities_.address();
  targets.counts = counts_.address();
  targets.offsets = grainOffsets_.address();
  targets.grains = grains_.address();
  targets.written = written_.address();
  targets.left = left_.address();
  commands_.begin();
  commands_.mark("write");
  record(commands_, targets, true);
  const std::uint64_t total = scanAndTotal(lists, left_, offsets_);
  appendOffsets(lists, result);
  if (total == 0) return;

  segments_.reserve(device_, total * sizeof(Segment), MemoryKind::DeviceLocal);
  shared::ReduceConstants reduce{};
  reduce.grains = grains_.address();
  reduce.grainOffsets = grainOffsets_.address();
  reduce.written = written_.address();
  reduce.left = left_.address();
  reduce.offsets = offsets_.address();
  reduce.segments = segments_.address();
  reduce.step = static_cast<float>(request.sampleStep);
  reduce.listCount = lists;
  reduce.form = storedForm(request.code);
  commands_.begin();
  commands_.mark("reduce");
  reduce_.record(commands_, reduce, request.most);
  download(total, result);
}

template void ListBuilder::build(const Request&, const Record&, SupersegmentLists&);
template void ListBuilder::build(const Request&, const Record&, CompactLists&);

}  // namespace vdi::detail
