#include "vdi/pipeline/ListBuilder.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <limits>

#include "vdi/core/Error.h"
#include "vdi/core/Parallel.h"

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
  offsetsReadback_.reserve(device_, words, MemoryKind::Readback);
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

void ListBuilder::wait() {
  commands_.wait();
  for (const gpu::StageTime& stage : commands_.stageTimes()) {
    if (stage.name == "download") continue;
    times_.all += stage.milliseconds;
    if (stage.name == "search") times_.search += stage.milliseconds;
    if (stage.name == "write") times_.write += stage.milliseconds;
  }
}

/// Ends the recording with the prefix sum of counts, submits, and returns the sum of all, which is the last
/// of the offsets; these are in offsetsReadback_, if they're wanted.
std::uint64_t ListBuilder::scanAndTotal(std::uint32_t listCount, const gpu::Buffer& counts,
                                        gpu::Buffer& offsets, Wanted wanted) {
  const std::uint64_t last = std::uint64_t{listCount} * sizeof(std::uint32_t);
  const std::uint64_t first = wanted == Wanted::Offsets ? 0 : last;
  scan_.record(commands_, counts, offsets, listCount);
  commands_.mark("download");
  commands_.copy(offsets, first, offsetsReadback_, first, last + sizeof(std::uint32_t) - first);
  commands_.submit();
  wait();
  scan_.demandNoOverflow();
  return offsetsReadback_.mappedAs<std::uint32_t>()[listCount];
}

template <typename Segment>
void ListBuilder::appendOffsets(std::uint32_t listCount, ListsOf<Segment>& result) const {
  const auto offsets = offsetsReadback_.mappedAs<std::uint32_t>().subspan(1, listCount);
  const std::uint32_t before = result.offsets.back();
  const std::size_t first = result.offsets.size();
  result.offsets.resize(first + listCount);
  std::ranges::transform(offsets, result.offsets.begin() + static_cast<std::ptrdiff_t>(first),
                         [&](std::uint32_t offset) { return before + offset; });
}

/// Ends the recording of what makes supersegments with the copy of them, submits, and appends them. The host
/// has something to do meanwhile: the offsets.
template <typename Segment>
void ListBuilder::download(std::uint32_t listCount, std::uint64_t total, ListsOf<Segment>& result) {
  const std::uint32_t before = result.offsets.back();
  if (before + total > std::numeric_limits<std::uint32_t>::max()) {
    throw Error(ErrorCode::OutOfMemory, "more than 2^32 supersegments in one VDI", device_->name());
  }
  const std::uint64_t bytes = total * sizeof(Segment);
  segmentsReadback_.reserve(device_, bytes, MemoryKind::Readback);
  commands_.barrier();
  commands_.mark("download");
  commands_.copy(segments_, 0, segmentsReadback_, 0, bytes);
  commands_.submit();
  appendOffsets(listCount, result);
  wait();
  replaceTail<Segment>(result.segments, before, segmentsReadback_.mappedAs<Segment>().first(total));
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
  const std::uint64_t total = scanAndTotal(request.listCount(), counts_, offsets_, Wanted::Offsets);
  if (total == 0) return appendOffsets(request.listCount(), result);

  segments_.reserve(device_, total * sizeof(Segment), MemoryKind::DeviceLocal);
  targets.segments = segments_.address();
  commands_.begin();
  commands_.mark("write");
  record(commands_, targets, true);
  download(request.listCount(), total, result);
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
  const std::uint64_t grainTotal = scanAndTotal(lists, counts_, grainOffsets_, Wanted::Total);

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
  const std::uint64_t total = scanAndTotal(lists, left_, offsets_, Wanted::Offsets);
  if (total == 0) return appendOffsets(lists, result);

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
  download(lists, total, result);
}

template void ListBuilder::build(const Request&, const Record&, SupersegmentLists&);
template void ListBuilder::build(const Request&, const Record&, CompactLists&);

}  // namespace vdi::detail
