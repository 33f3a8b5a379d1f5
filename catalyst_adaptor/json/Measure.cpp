#include "catalyst_adaptor/json/Measure.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <mutex>
#include <utility>

#include "vdi/comm/GhostExchange.h"
#include "vdi/core/Parallel.h"

namespace vdi::catalyst {

namespace {

/// Totals over the values seen so far.
struct Totals {
  double max = -std::numeric_limits<double>::infinity();
  double min = std::numeric_limits<double>::infinity();
  double sum = 0.0;     // sum of finite values times their volumes
  double volume = 0.0;  // total volume of the finite values

  void take(double value, double extent) {
    if (std::isnan(value)) return;
    max = std::max(max, value);
    min = std::min(min, value);
    if (std::isinf(value)) return;
    sum += value * extent;
    volume += extent;
  }
  void take(const Totals& other) {
    max = std::max(max, other.max);
    min = std::min(min, other.min);
    sum += other.sum;
    volume += other.volume;
  }
};

template <typename Scalar>
struct Load {
  double operator()(const std::byte* from) const {
    Scalar value{};  // copied, because the source may be unaligned
    std::memcpy(&value, from, sizeof value);
    return static_cast<double>(value);
  }
};

/// Calls `visit` with an object that loads a value of the type.
template <typename Visit>
void withLoad(int type, Visit visit) {
  switch (type) {
    case VDI_CATALYST_U8:
      return visit(Load<std::uint8_t>());
    case VDI_CATALYST_I8:
      return visit(Load<std::int8_t>());
    case VDI_CATALYST_U16:
      return visit(Load<std::uint16_t>());
    case VDI_CATALYST_I16:
      return visit(Load<std::int16_t>());
    case VDI_CATALYST_U32:
      return visit(Load<std::uint32_t>());
    case VDI_CATALYST_I32:
      return visit(Load<std::int32_t>());
    case VDI_CATALYST_F32:
      return visit(Load<float>());
    case VDI_CATALYST_I64:
      return visit(Load<std::int64_t>());
    case VDI_CATALYST_U64:
      return visit(Load<std::uint64_t>());
    default:
      return visit(Load<double>());
  }
}

}  // namespace

/// Visits the values of a part.
class Sweep {
 public:
  Sweep(const Measure::OwnedPart& part, const StridedValues& values, int component)
      : part_(part), values_(values), component_(values.components > 1 ? component : 0) {}

  template <typename Loader>
  Totals run(Loader load) const {
    Totals all;
    std::mutex mutex;
    const std::size_t rows = part_.extents[1].size();
    const std::size_t slices = part_.extents[2].size();
    const std::size_t slice = rows * part_.extents[0].size();
    constexpr std::size_t values = 100000;  // these take some 100 us
    inParallel(slices, std::max<std::size_t>(1, values / slice), [&](std::size_t first, std::size_t last) {
      Totals mine;
      for (std::size_t k = first; k < last; ++k) {
        for (std::size_t j = 0; j < rows; ++j) mine.take(row(load, j, k));
      }
      const std::scoped_lock lock(mutex);
      all.take(mine);
    });
    return all;
  }

 private:
  template <typename Loader>
  Totals row(Loader load, std::size_t j, std::size_t k) const {
    const std::byte* at = values_.first + part_.first[0] * values_.strides[0] +
                          (part_.first[1] + static_cast<std::int64_t>(j)) * values_.strides[1] +
                          (part_.first[2] + static_cast<std::int64_t>(k)) * values_.strides[2];
    const double area = part_.extents[1][j] * part_.extents[2][k];
    Totals totals;
    for (const double length : part_.extents[0]) {
      totals.take(valueAt(load, at), length * area);
      at += values_.strides[0];
    }
    return totals;
  }
  template <typename Loader>
  double valueAt(Loader load, const std::byte* at) const {
    if (component_ >= 0) return load(at + component_ * values_.componentStride);
    if (component_ == phase) return std::atan2(load(at + values_.componentStride), load(at));
    double squares = 0.0;
    for (int c = 0; c < values_.components; ++c) {
      const double value = load(at + c * values_.componentStride);
      squares += value * value;
    }
    return std::sqrt(squares);
  }

  const Measure::OwnedPart& part_;
  const StridedValues& values_;
  int component_;  // or magnitude, or phase
};

/// The part of a block; nullopt if it owns no value. A value stands for the cell or point beside which its
/// array's offset puts it, because the owned box doesn't move with the values.
std::optional<Measure::OwnedPart> Measure::partOf(std::size_t index, const Block& block) {
  constexpr double least = 1e-3;  // share of a spacing by which coinciding faces may differ
  OwnedPart part;
  part.block = index;
  for (int axis = 0; axis < 3; ++axis) {
    const double spacing = block.spacing[axis];
    std::vector<double>& extents = part.extents[static_cast<std::size_t>(axis)];
    for (int i = 0; i < block.dims[axis]; ++i) {
      const double middle = block.origin[axis] + (i - block.offset[axis]) * spacing;
      const double extent = std::min(middle + 0.5 * spacing, block.owned.hi[axis]) -
                            std::max(middle - 0.5 * spacing, block.owned.lo[axis]);
      if (!(extent > least * spacing)) continue;
      if (extents.empty()) part.first[static_cast<std::size_t>(axis)] = i;
      extents.push_back(extent);
    }
    if (extents.empty()) return std::nullopt;
  }
  return part;
}

void Measure::findParts(const comm::Communicator& comm, const Fields& fields, bool cells) {
  std::vector<Block> places;
  std::vector<std::pair<std::size_t, glm::dvec3>> sources;
  const auto indexOf = [&](const Block& place) {
    return static_cast<std::size_t>(static_cast<const vdi_catalyst_block*>(place.data) -
                                    fields.blocks().data());
  };
  const bool areNew = comm.anyTogether([&] {
    places = fields.placesOf(condition_.field, cells);
    for (const Block& place : places) sources.emplace_back(indexOf(place), place.origin);
    return version_ != fields.version() || cells_ != cells || sources_ != sources;
  });
  if (!areNew) return;
  version_.reset();
  places = comm::settleOwnership(comm, std::move(places));
  comm.together([&] {
    parts_.clear();
    for (const Block& place : places) {
      std::optional<OwnedPart> part = partOf(indexOf(place), place);
      if (part) parts_.push_back(std::move(*part));
    }
  });
  version_ = fields.version();
  cells_ = cells;
  sources_ = std::move(sources);
}

std::optional<double> Measure::of(const comm::Communicator& comm, const Fields& fields) {
  const bool cells = agreeOnCells(comm, fields, condition_.field, condition_.cells);
  findParts(comm, fields, cells);
  Totals totals;
  comm.together([&] {
    const Fields::Values values = fields.valuesOf(condition_.field, cells, condition_.component);
    withLoad(values.type, [&](auto load) {
      for (const OwnedPart& part : parts_) {
        const Sweep sweep(part, values.blocks[part.block], condition_.component);
        totals.take(sweep.run(load));
      }
    });
  });
  using Kind = config::RunCondition::Measure;
  if (condition_.measure == Kind::Max || condition_.measure == Kind::Min) {
    std::array<double, 2> ends{totals.max, -totals.min};
    comm.allReduceMax(ends);
    if (!(ends[0] >= -ends[1])) return std::nullopt;
    return condition_.measure == Kind::Max ? ends[0] : -ends[1];
  }
  std::array<double, 2> sums{totals.sum, totals.volume};
  comm.allReduceSum(sums);
  if (!(sums[1] > 0.0)) return std::nullopt;
  return sums[0] / sums[1];
}

}  // namespace vdi::catalyst
