#include "vdi/pipeline/ListBuilder.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

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
      status_(device_, sizeof(std::uint32_t), MemoryKind::Readback),
      total_(device_, sizeof(std::uint32_t), MemoryKind::Readback) {}

shared::StoredForm storedForm(const DepthCode& code) {
  return {code.first, code.step};
}

std::uint64_t ListBuilder::bytesPerList(std::uint32_t most, Algorithm algorithm) {
  const std::uint64_t segments = std::uint64_t{most} * sizeof(Supersegment);
  if (algorithm == Algorithm::Bisection) return segments;
  return segments + shared::mostGrains(most) * sizeof(shared::StoredGrain);
}

void ListBuilder::build(const Request& request, const Record& record, DeviceLists& lists,
                        const Finish& finish) {
  const std::uint64_t words = (std::uint64_t{request.listCount()} + 1) * sizeof(std::uint32_t);
  sensitivities_.reserve(device_, words, MemoryKind::DeviceLocal);
  counts_.reserve(device_, words, MemoryKind::DeviceLocal);
  lists.offsets.reserve(device_, words, MemoryKind::DeviceLocal);
  lists.listCount = request.listCount();
  status_.mappedAs<std::uint32_t>()[0] = 0;
  times_ = {};
  if (request.algorithm == Algorithm::Bisection) {
    buildByBisection(request, record, lists, finish);
  } else {
    buildByMerging(request, record, lists, finish);
  }
  if (const std::uint32_t wrong = status_.mappedAs<std::uint32_t>()[0]; wrong != 0) {
    throw Error(ErrorCode::DeviceFailure,
                fmt::format("{} lists were written with another count than was stored", wrong),
                device_->name());
  }
}

/// Submits, waits, and adds up the times.
void ListBuilder::end(const Finish& finish) {
  if (finish) finish(commands_);
  commands_.submitAndWait();
  for (const gpu::StageTime& stage : commands_.stageTimes()) {
    if (stage.name == "download") continue;
    times_.all += stage.milliseconds;
    if (stage.name == "search") times_.search += stage.milliseconds;
    if (stage.name == "write") times_.write += stage.milliseconds;
  }
}

/// Ends the recording with the prefix sum of counts, and returns the sum of all.
std::uint64_t ListBuilder::scanAndTotal(std::uint32_t listCount, const gpu::Buffer& counts,
                                        gpu::Buffer& offsets) {
  scan_.record(commands_, counts, offsets, listCount);
  end([&](gpu::Commands& commands) {
    commands.mark("download");
    commands.copy(offsets, std::uint64_t{listCount} * sizeof(std::uint32_t), total_, 0,
                  sizeof(std::uint32_t));
  });
  scan_.demandNoOverflow();
  return total_.mappedAs<std::uint32_t>()[0];
}

void ListBuilder::buildByBisection(const Request& request, const Record& record, DeviceLists& lists,
                                   const Finish& finish) {
  BandTargets targets;
  targets.sensitivities = sensitivities_.address();
  targets.counts = counts_.address();
  targets.offsets = lists.offsets.address();
  targets.status = status_.address();
  commands_.begin();
  commands_.mark("search");
  record(commands_, targets, false);
  lists.count = scanAndTotal(request.listCount(), counts_, lists.offsets);

  lists.segments.reserve(device_, lists.count * segmentBytes(request.code), MemoryKind::DeviceLocal);
  targets.segments = lists.segments.address();
  commands_.begin();
  commands_.mark("write");
  if (lists.count > 0) record(commands_, targets, true);
  end(finish);
}

void ListBuilder::buildByMerging(const Request& request, const Record& record, DeviceLists& lists,
                                 const Finish& finish) {
  const std::uint32_t listCount = request.listCount();
  const std::uint64_t words = (std::uint64_t{listCount} + 1) * sizeof(std::uint32_t);
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
  shared::AllotConstants allot{};
  allot.countedTolerances = countedTolerances_.address();
  allot.countedGrains = countedGrains_.address();
  allot.tolerances = sensitivities_.address();
  allot.rooms = counts_.address();
  allot.width = request.width;
  allot.rows = request.rows;
  allot.countedWidth = request.countedWidth();
  allot.countedRows = request.countedRows();
  allot.strideShift = static_cast<std::uint32_t>(std::countr_zero(request.countedStride));
  commands_.begin();
  commands_.mark("search");
  if (request.agreed) {
    quotas_.reserve(device_, words, MemoryKind::DeviceLocal);
    allot.countedTolerances = request.agreed->tolerances;
    allot.countedGrains = request.agreed->grains;
    allot.countedQuotas = request.agreed->quotas;
    allot.quotas = quotas_.address();
    allot.budget = request.agreed->budget;
    targets.quotas = quotas_.address();
  } else {
    record(commands_, targets, false);
    commands_.barrier();
  }
  allot_.record(commands_, allot);

  targets.sensitivities = sensitivities_.address();
  targets.counts = counts_.address();
  targets.offsets = grainOffsets_.address();
  targets.written = written_.address();
  targets.left = left_.address();
  const auto writeGrains = [&] {
    const std::uint64_t grainTotal = scanAndTotal(listCount, counts_, grainOffsets_);
    grains_.reserve(device_, grainTotal * sizeof(shared::StoredGrain), MemoryKind::DeviceLocal);
    targets.grains = grains_.address();
    commands_.begin();
    commands_.mark("write");
    record(commands_, targets, true);
  };
  writeGrains();
  lists.count = scanAndTotal(listCount, left_, lists.offsets);
  // Lists between the counted ones may have more runs than these. They've said how many: now all fit.
  if (auto& tooLong = status_.mappedAs<std::uint32_t>()[0]; request.agreed && tooLong != 0) {
    tooLong = 0;
    commands_.begin();
    writeGrains();
    lists.count = scanAndTotal(listCount, left_, lists.offsets);
  }

  lists.segments.reserve(device_, lists.count * segmentBytes(request.code), MemoryKind::DeviceLocal);
  shared::ReduceConstants reduce{};
  reduce.grains = grains_.address();
  reduce.grainOffsets = grainOffsets_.address();
  reduce.written = written_.address();
  reduce.left = left_.address();
  reduce.offsets = lists.offsets.address();
  reduce.segments = lists.segments.address();
  reduce.step = static_cast<float>(request.sampleStep);
  reduce.listCount = listCount;
  reduce.form = storedForm(request.code);
  commands_.begin();
  commands_.mark("reduce");
  if (lists.count > 0) reduce_.record(commands_, reduce, request.most);
  end(finish);
}

}  // namespace vdi::detail
