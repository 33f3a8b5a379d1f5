#include "catalyst_adaptor/json/Measure.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
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

}  // namespace

/// Totals over the values of a part.
class Sweep {
 public:
  Sweep(const Measure::OwnedPart& part, const Block& block) : part_(part), block_(block) {}

  Totals run() const {
    Totals all;
    std::mutex mutex;
    const std::size_t rows = part_.extents[1].size();
    const std::size_t slices = part_.extents[2].size();
    const std::size_t slice = rows * part_.extents[0].size();
    constexpr std::size_t values = 100000;  // these take some 100 us
    inParallel(slices, std::max<std::size_t>(1, values / slice), [&](std::size_t first, std::size_t last) {
      Totals mine;
      TileBuffer buffer;
      for (std::size_t k = first; k < last; ++k) {
        const IndexBox sliceBox = boxOf(k);
        const Tiling tiles = block_.tilesOf(sliceBox);
        for (std::size_t i = 0; i < tiles.count(); ++i) take(tiles[i], buffer, mine);
      }
      const std::scoped_lock lock(mutex);
      all.take(mine);
    });
    return all;
  }

 private:
  IndexBox boxOf(std::size_t slice) const {
    const glm::ivec3 lo = part_.first + glm::ivec3(0, 0, static_cast<int>(slice));
    const glm::ivec3 size(part_.extents[0].size(), part_.extents[1].size(), 1);
    return {lo, lo + size};
  }
  void take(const IndexBox& tile, TileBuffer& buffer, Totals& totals) const {
    block_.copyTo(tile, buffer.bytes.data());
    const auto extent = [&](int axis, int index) {
      return part_
          .extents[static_cast<std::size_t>(axis)][static_cast<std::size_t>(index - part_.first[axis])];
    };
    withTyped(block_.type, static_cast<const void*>(buffer.bytes.data()), [&](const auto* values) {
      for (int z = tile.lo.z; z < tile.hi.z; ++z) {
        for (int y = tile.lo.y; y < tile.hi.y; ++y) {
          const double area = extent(1, y) * extent(2, z);
          for (int x = tile.lo.x; x < tile.hi.x; ++x)
            totals.take(static_cast<double>(*values++), extent(0, x) * area);
        }
      }
    });
  }

  const Measure::OwnedPart& part_;
  const Block& block_;
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
      if (extents.empty()) part.first[axis] = i;
      extents.push_back(extent);
    }
    if (extents.empty()) return std::nullopt;
  }
  return part;
}

void Measure::findParts(const comm::Communicator& comm, const Fields& fields, bool cells) {
  std::vector<Block> places;
  std::vector<std::pair<const void*, glm::dvec3>> sources;
  std::map<const void*, std::size_t> numbers;  // among the blocks that have the array
  const bool areNew = comm.anyTogether([&] {
    places = fields.placesOf(condition_.field, cells);
    for (const Block& place : places) {
      numbers.emplace(place.data, numbers.size());
      sources.emplace_back(place.data, place.origin);
    }
    return version_ != fields.version() || cells_ != cells || sources_ != sources;
  });
  if (!areNew) return;
  version_.reset();
  places = comm::settleOwnership(comm, std::move(places));
  comm.together([&] {
    parts_.clear();
    for (const Block& place : places) {
      std::optional<OwnedPart> part = partOf(numbers.at(place.data), place);
      if (part) parts_.push_back(std::move(*part));
    }
  });
  version_ = fields.version();
  cells_ = cells;
  sources_ = std::move(sources);
}

std::optional<double> Measure::of(const comm::Communicator& comm, Fields& fields) {
  const bool cells = agreeOnCells(comm, fields, condition_.field, condition_.cells);
  findParts(comm, fields, cells);
  Totals totals;
  comm.together([&] {
    fields.fetch(condition_.field, cells);
    const std::vector<Block> blocks =
        fields.blocksOf(condition_.field, cells, condition_.component, condition_.missing);
    for (const OwnedPart& part : parts_) totals.take(Sweep(part, blocks[part.block]).run());
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
