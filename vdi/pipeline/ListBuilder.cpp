#include "vdi/pipeline/ListBuilder.h"

#include <fmt/format.h>

#include <limits>

#include "vdi/core/Error.h"

namespace vdi::detail {

using gpu::MemoryKind;

ListBuilder::ListBuilder(std::shared_ptr<gpu::Device> device)
    : device_(std::move(device)),
      commands_(device_),
      scan_(device_),
      status_(device_, sizeof(std::uint32_t), MemoryKind::Readback) {}

void ListBuilder::build(std::uint32_t listCount, const Record& record, SupersegmentLists& result) {
  const std::uint64_t words = (std::uint64_t{listCount} + 1) * sizeof(std::uint32_t);
  sensitivities_.reserve(device_, words, MemoryKind::DeviceLocal);
  counts_.reserve(device_, words, MemoryKind::DeviceLocal);
  offsets_.reserve(device_, words, MemoryKind::DeviceLocal);
  readback_.reserve(device_, words, MemoryKind::Readback);
  status_.mappedAs<std::uint32_t>()[0] = 0;
  BandTargets targets{sensitivities_.address(), counts_.address(), offsets_.address(), 0, status_.address()};

  commands_.begin();
  record(commands_, targets, false);
  commands_.barrier();
  scan_.record(commands_, counts_, offsets_, listCount);
  commands_.copy(offsets_, 0, readback_, 0, words);
  commands_.submitAndWait();
  scan_.demandNoOverflow();

  const auto offsets = readback_.mappedAs<std::uint32_t>();
  const std::uint64_t total = offsets[listCount];
  const std::uint64_t before = result.segments.size();
  if (before + total > std::numeric_limits<std::uint32_t>::max()) {
    throw Error(ErrorCode::OutOfMemory, "more than 2^32 supersegments in one VDI", device_->name());
  }
  for (std::uint32_t i = 1; i <= listCount; ++i) {
    result.offsets.push_back(static_cast<std::uint32_t>(before + offsets[i]));
  }
  if (total == 0) return;

  const std::uint64_t bytes = total * sizeof(Supersegment);
  segments_.reserve(device_, bytes, MemoryKind::DeviceLocal);
  targets.segments = segments_.address();
  readback_.reserve(device_, bytes, MemoryKind::Readback);
  commands_.begin();
  record(commands_, targets, true);
  commands_.barrier();
  commands_.copy(segments_, 0, readback_, 0, bytes);
  commands_.submitAndWait();
  if (const std::uint32_t wrong = status_.mappedAs<std::uint32_t>()[0]; wrong != 0) {
    throw Error(ErrorCode::DeviceFailure,
                fmt::format("{} lists were written with another count than was stored", wrong),
                device_->name());
  }
  const auto written = readback_.mappedAs<Supersegment>().first(total);
  result.segments.insert(result.segments.end(), written.begin(), written.end());
}

}  // namespace vdi::detail
