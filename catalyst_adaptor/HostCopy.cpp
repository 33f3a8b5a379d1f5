#include "catalyst_adaptor/HostCopy.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <stdexcept>
#include <utility>

namespace vdi::catalyst {

namespace {

/// An axis of values, or their components.
struct Axis {
  std::int64_t count;
  std::int64_t stride;  // in the values' memory
  std::int64_t* copyStride;
};

/// Whether rows at this distance are copied with what lies between them: rows of few bytes, and small gaps.
bool areJoined(std::int64_t distance, std::int64_t rowBytes) {
  constexpr std::int64_t shortRow = 256;
  constexpr std::int64_t most = 32;
  constexpr std::int64_t smallPart = 8;
  return distance <= rowBytes + rowBytes / smallPart || (rowBytes < shortRow && distance <= most * rowBytes);
}

std::size_t aligned(std::size_t bytes) {
  constexpr std::size_t line = 64;
  return (bytes + line - 1) / line * line;
}

std::size_t bytesOf(const NumberColumn& column) {
  return column.isDouble ? sizeof(double) : sizeof(float);
}

}  // namespace

CopyPlan planCopy(const StridedValues& values) {
  CopyPlan plan;
  plan.copy = values;
  plan.copy.first = nullptr;
  std::array<Axis, 4> axes{{{values.counts[0], values.strides[0], &plan.copy.strides[0]},
                            {values.counts[1], values.strides[1], &plan.copy.strides[1]},
                            {values.counts[2], values.strides[2], &plan.copy.strides[2]},
                            {values.components, values.componentStride, &plan.copy.componentStride}}};
  std::ranges::sort(axes, {}, [](const Axis& axis) { return std::abs(axis.stride); });
  plan.rows.from = values.first;
  auto row = static_cast<std::int64_t>(values.scalarBytes);
  std::int64_t copied = row;  // bytes of the copy
  std::size_t rank = 0;       // of the axes along which rows lie
  for (const Axis& axis : axes) {
    if (axis.count == 1 || axis.stride == 0) continue;
    const std::int64_t distance = std::abs(axis.stride);
    std::int64_t copyDistance = distance;
    if (rank == 0 && areJoined(distance, row)) {
      row += (axis.count - 1) * distance;
      copied = row;
    } else {
      copyDistance = copied;
      plan.rows.counts[rank] = axis.count;
      plan.rows.fromStrides[rank] = distance;
      plan.rows.toStrides[rank] = copyDistance;
      // Rows that overlap may be more than the memory in which they lie.
      if (__builtin_mul_overflow(copied, axis.count, &copied))
        throw std::runtime_error("the values are too many to copy");
      ++rank;
    }
    *axis.copyStride = axis.stride < 0 ? -copyDistance : copyDistance;
    if (axis.stride >= 0) continue;
    plan.rows.from += (axis.count - 1) * axis.stride;
    plan.first += (axis.count - 1) * copyDistance;
  }
  plan.rows.rowBytes = static_cast<std::size_t>(row);
  plan.bytes = static_cast<std::size_t>(copied);
  return plan;
}

MemoryRange extentOf(const NumberColumn& column, std::size_t count) {
  const std::int64_t reach = static_cast<std::int64_t>(count - 1) * column.stride;
  return {column.first + std::min<std::int64_t>(reach, 0),
          static_cast<std::size_t>(std::abs(reach)) + bytesOf(column)};
}

std::shared_ptr<HostCopy> HostCopy::ofBlocks(std::vector<StridedValues>& values,
                                             std::span<const std::size_t> onDevice,
                                             const std::shared_ptr<HostCopy>& before) {
  auto made = std::make_shared<HostCopy>();
  std::vector<CopyPlan> plans;
  std::size_t bytes = 0;
  for (const std::size_t block : onDevice) {
    const CopyPlan& plan = plans.emplace_back(planCopy(values[block]));
    bytes += aligned(plan.bytes);
  }
  made->allocate(bytes, before.get());
  std::byte* to = made->buffer_->data();
  for (std::size_t i = 0; i < plans.size(); ++i) {
    CopyPlan& plan = plans[i];
    plan.rows.to = to;
    plan.copy.first = to + plan.first;
    to += aligned(plan.bytes);
    values[onDevice[i]] = plan.copy;
    made->parts_.push_back({plan.rows, onDevice[i]});
  }
  return made;
}

std::shared_ptr<HostCopy> HostCopy::ofColumns(std::span<NumberColumn* const> columns, std::size_t count,
                                              const std::shared_ptr<HostCopy>& before) {
  std::vector<MemoryRange> ranges;  // in order, apart from each other
  for (const NumberColumn* column : columns) ranges.push_back(extentOf(*column, count));
  std::ranges::sort(ranges, std::less(), &MemoryRange::begin);
  std::size_t last = 0;
  for (const MemoryRange& range : ranges) {
    MemoryRange& joined = ranges[last];
    if (range.begin < joined.begin + joined.bytes) {
      joined.bytes = std::max<std::size_t>(
          joined.bytes, static_cast<std::size_t>(range.begin - joined.begin) + range.bytes);
    } else {
      ranges[++last] = range;
    }
  }
  ranges.resize(last + 1);
  auto made = std::make_shared<HostCopy>();
  std::size_t bytes = 0;
  for (const MemoryRange& range : ranges) bytes += aligned(range.bytes);
  made->allocate(bytes, before.get());
  std::byte* to = made->buffer_->data();
  for (const MemoryRange& range : ranges) {
    made->parts_.push_back({{range.begin, to, range.bytes}, std::nullopt});
    to += aligned(range.bytes);
  }
  for (NumberColumn* column : columns) {
    const auto holds = [&](const Part& part) {
      return part.rows.from <= column->first && column->first < part.rows.from + part.rows.rowBytes;
    };
    const RowCopy& rows = std::ranges::find_if(made->parts_, holds)->rows;
    column->first = rows.to + (column->first - rows.from);
  }
  return made;
}

void HostCopy::allocate(std::size_t bytes, const HostCopy* before) {
  const bool fits = before != nullptr && before->buffer_->data() != nullptr &&
                    bytes <= before->buffer_->bytes() && before->buffer_->bytes() / 2 <= bytes;
  buffer_ = fits ? before->buffer_ : std::make_shared<HostBuffer>(bytes + bytes / 8);
}

void HostCopy::addTo(std::vector<BufferCopy>& copies, std::string_view owner) const {
  for (const Part& part : parts_) copies.push_back({part.rows, buffer_, owner, part.block});
}

}  // namespace vdi::catalyst
