#include "vdi/comm/BlockDirectory.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <mutex>
#include <numeric>
#include <tuple>

#include "vdi/core/Error.h"
#include "vdi/core/Parallel.h"

namespace vdi::comm {

namespace {

/// Finding a block's neighbours takes a few microseconds.
constexpr std::size_t blocksPerThread = 32;

/// Owned boxes of point data end at values, those of cell data half-way between two.
bool isOfCells(const Block& block) {
  int half = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double face : {block.owned.lo[axis], block.owned.hi[axis]}) {
      const double place = (face - block.origin[axis]) / block.spacing[axis] + block.offset[axis];
      half += std::abs(place - std::floor(place) - 0.5) < 0.25 ? 1 : 0;
    }
  }
  return half > 3;
}

std::vector<BlockEntry> entriesOf(std::span<const Block> blocks, int rank) {
  std::vector<BlockEntry> entries;
  using Key = std::tuple<const void*, std::array<double, 6>, std::array<int, 3>, std::array<std::int64_t, 3>>;
  std::map<Key, std::int32_t> grids;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const Block& b = blocks[i];
    if (b.owned.empty()) continue;
    const ByteStrides strides = b.strides.value_or(ByteStrides(0));
    const Key key{b.data,
                  {b.origin.x, b.origin.y, b.origin.z, b.spacing.x, b.spacing.y, b.spacing.z},
                  {b.dims.x, b.dims.y, b.dims.z},
                  {strides.x, strides.y, strides.z}};
    const auto grid = grids.try_emplace(key, static_cast<std::int32_t>(grids.size())).first->second;
    entries.push_back({b.origin, b.spacing, b.offset, b.owned, b.owned, b.dims, rank,
                       static_cast<std::int32_t>(i), grid, isOfCells(b), b.masked && !b.masked->empty()});
  }
  return entries;
}

/// The distance, per axis, by which faces of the two blocks may differ and yet count as one.
glm::dvec3 toleranceOf(const BlockEntry& a, const BlockEntry& b) {
  return latticeTolerance * glm::min(a.spacing, b.spacing);
}

bool overlapBy(const Box& a, const Box& b, const glm::dvec3& tolerance) {
  return glm::all(glm::greaterThan(glm::min(a.hi, b.hi) - glm::max(a.lo, b.lo), tolerance));
}

/// Merges close faces of all blocks along one axis: faces that follow each other within the tolerance all
/// move to the lowest of them.
void makeFacesOne(std::span<BlockEntry> entries, int axis) {
  struct Face {
    double at;
    double tolerance;
    double* place;
  };
  std::vector<Face> faces;
  faces.reserve(2 * entries.size());
  for (BlockEntry& entry : entries) {
    const double tolerance = latticeTolerance * entry.spacing[axis];
    for (double* place : {&entry.owned.lo[axis], &entry.owned.hi[axis]})
      faces.push_back({*place, tolerance, place});
  }
  std::stable_sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) { return a.at < b.at; });
  for (std::size_t i = 1; i < faces.size(); ++i) {
    const Face& before = faces[i - 1];
    if (faces[i].at - before.at <= std::min(faces[i].tolerance, before.tolerance))
      *faces[i].place = *before.place;
  }
}

std::string nameOf(const BlockEntry& entry) {
  return fmt::format("block {} of rank {} (from ({}, {}, {}) to ({}, {}, {}))", entry.block, entry.rank,
                     entry.asked.lo.x, entry.asked.lo.y, entry.asked.lo.z, entry.asked.hi.x, entry.asked.hi.y,
                     entry.asked.hi.z);
}

}  // namespace

LevelOrder levelOrderOf(const BlockEntry& block, const BlockEntry& comparedWith) {
  const double ratio = block.valueVolume() / comparedWith.valueVolume();
  return ratio < 0.99 ? LevelOrder::Finer : ratio > 1.0 / 0.99 ? LevelOrder::Coarser : LevelOrder::Same;
}

BoxTree::BoxTree(std::vector<Box> boxes) : boxes_(std::move(boxes)), order_(boxes_.size()) {
  std::iota(order_.begin(), order_.end(), 0);
  if (order_.empty()) return;
  nodes_.push_back({{}, 0, order_.size(), 0, 0});
  build(0);
}

void BoxTree::build(std::size_t node) {
  const auto [bounds, first, last, lower, upper] = nodes_[node];
  Box all;
  for (std::size_t i = first; i < last; ++i) all.include(boxes_[order_[i]]);
  nodes_[node].bounds = all;
  constexpr std::size_t maxInLeaf = 4;
  if (last - first <= maxInLeaf) return;
  const glm::dvec3 size = all.size();
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const std::size_t middle = (first + last) / 2;
  const auto at = [&](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(first), at(middle), at(last), [&](std::size_t a, std::size_t b) {
    return boxes_[a].lo[axis] + boxes_[a].hi[axis] < boxes_[b].lo[axis] + boxes_[b].hi[axis];
  });
  const std::size_t children = nodes_.size();
  nodes_[node].lower = children;
  nodes_[node].upper = children + 1;
  nodes_.push_back({{}, first, middle, 0, 0});
  nodes_.push_back({{}, middle, last, 0, 0});
  build(children);
  build(children + 1);
}

std::vector<std::size_t> BoxTree::meeting(const Box& box) const {
  const auto meets = [&box](const Box& other) {
    return glm::all(glm::lessThanEqual(box.lo, other.hi)) && glm::all(glm::lessThanEqual(other.lo, box.hi));
  };
  std::vector<std::size_t> found;
  std::vector<std::size_t> open;
  if (!nodes_.empty()) open.push_back(0);
  while (!open.empty()) {
    const Node& node = nodes_[open.back()];
    open.pop_back();
    if (!meets(node.bounds)) continue;
    if (node.lower != 0) {
      open.push_back(node.lower);
      open.push_back(node.upper);
      continue;
    }
    for (std::size_t i = node.first; i < node.last; ++i) {
      if (meets(boxes_[order_[i]])) found.push_back(order_[i]);
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::optional<std::size_t> BoxTree::containing(const glm::dvec3& point) const {
  const auto holds = [&point](const Box& box) {
    return glm::all(glm::lessThanEqual(box.lo, point)) && glm::all(glm::lessThan(point, box.hi));
  };
  // Each level halves the boxes, so few nodes are open at a time.
  constexpr std::size_t most = std::numeric_limits<std::size_t>::digits;
  std::array<std::size_t, 2 * most> open{};
  std::size_t count = nodes_.empty() ? 0 : 1;
  while (count > 0) {
    const Node& node = nodes_[open[--count]];
    if (!holds(node.bounds)) continue;
    if (node.lower != 0) {
      open[count++] = node.lower;
      open[count++] = node.upper;
      continue;
    }
    for (std::size_t i = node.first; i < node.last; ++i) {
      if (holds(boxes_[order_[i]])) return order_[i];
    }
  }
  return std::nullopt;
}

BlockDirectory::BlockDirectory(const Communicator& comm, std::span<const Block> mine, bool closeGaps) {
  static_assert(std::is_trivially_copyable_v<BlockEntry>);
  std::vector<BlockEntry> own;
  comm.together([&] { own = entriesOf(mine, comm.rank()); });
  const Gathered gathered = comm.allGather(std::as_bytes(std::span(own)), sizeof(BlockEntry));
  comm.together([&] {
    entries_.resize(gathered.bytes.size() / sizeof(BlockEntry));
    if (!entries_.empty()) std::memcpy(entries_.data(), gathered.bytes.data(), gathered.bytes.size());
    const auto rank = static_cast<std::size_t>(comm.rank());
    firstMine_ = gathered.offsets[rank] / sizeof(BlockEntry);
    lastMine_ = gathered.offsets[rank + 1] / sizeof(BlockEntry);
    if (closeGaps) plantTree();
  });
  if (closeGaps) growOverGaps(comm);
  comm.together([&] {
    for (int axis = 0; axis < 3; ++axis) makeFacesOne(entries_, axis);
    plantTree();
  });
}

void BlockDirectory::plantTree() {
  std::vector<Box> boxes;
  boxes.reserve(entries_.size());
  for (const BlockEntry& entry : entries_) boxes.emplace_back(entry.storedBox()).include(entry.owned);
  tree_ = std::make_unique<BoxTree>(std::move(boxes));
}

/// Each rank finds the gaps that its own blocks must close, and tells the others.
void BlockDirectory::growOverGaps(const Communicator& comm) {
  std::vector<Box> grown;
  std::array<std::uint64_t, 1> any{0};
  comm.together([&] {
    grown.resize(lastMine_ - firstMine_);
    std::atomic<bool> found{false};
    inParallel(grown.size(), blocksPerThread, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) {
        const BlockEntry& entry = entries_[firstMine_ + i];
        Box& box = grown[i] = entry.owned;
        for (int axis = 0; axis < 3 && !entry.cells; ++axis) {
          for (const bool above : {false, true}) {
            const double gap = gapBeside(firstMine_ + i, box, axis, above);
            if (gap > 0.0) found = true;
            (above ? box.hi : box.lo)[axis] += above ? gap : -gap;
          }
        }
      }
    });
    any[0] = found ? 1 : 0;
  });
  comm.allReduceMax(any);
  if (any[0] == 0) return;
  const Gathered gathered = comm.allGather(std::as_bytes(std::span(grown)), sizeof(Box));
  for (std::size_t i = 0; i < entries_.size(); ++i)
    std::memcpy(&entries_[i].owned, gathered.bytes.data() + i * sizeof(Box), sizeof(Box));
}

/// The distance by which a block of points that now owns `box` must grow on this side.
double BlockDirectory::gapBeside(std::size_t index, const Box& box, int axis, bool above) const {
  const BlockEntry& own = entries_[index];
  const double widest = (1.0 + latticeTolerance) * own.spacing[axis];
  Box beside = box;
  (above ? beside.lo : beside.hi)[axis] = (above ? box.hi : box.lo)[axis];
  (above ? beside.hi : beside.lo)[axis] = (above ? box.hi : box.lo)[axis] + (above ? widest : -widest);
  double nearest = std::numeric_limits<double>::infinity();
  for (const std::size_t j : meeting(beside)) {
    const BlockEntry& other = entries_[j];
    if (j == index || other.cells) continue;
    const glm::dvec3 tolerance = toleranceOf(own, other);
    Box across = box;  // as wide as the other block along this axis
    across.lo[axis] = other.owned.lo[axis];
    across.hi[axis] = other.owned.hi[axis];
    const double distance = above ? other.owned.lo[axis] - box.hi[axis] : box.lo[axis] - other.owned.hi[axis];
    const double end = above ? other.owned.hi[axis] - box.hi[axis] : box.lo[axis] - other.owned.lo[axis];
    if (end <= tolerance[axis] || !overlapBy(across, other.owned, tolerance)) continue;
    if (distance <= tolerance[axis]) return 0.0;  // no gap
    const LevelOrder order = levelOrderOf(other, own);
    if (order == LevelOrder::Finer || (order == LevelOrder::Same && above))
      nearest = std::min(nearest, distance);
  }
  return nearest <= widest ? nearest : 0.0;
}

std::vector<OwnParts> settleOverlaps(const Communicator& comm, const BlockDirectory& directory) {
  const std::span<const BlockEntry> entries = directory.entries();
  std::vector<OwnParts> parts;
  std::array<std::uint64_t, 1> conflict{0};  // complement of the first conflicting pair; 0: none
  std::mutex conflictMutex;
  const auto settle = [&](std::size_t first, std::size_t last) {
    for (std::size_t i = directory.firstMine() + first; i < directory.firstMine() + last; ++i) {
      const BlockEntry& own = entries[i];
      OwnParts& left = parts[i - directory.firstMine()];
      for (const std::size_t j : directory.meeting(own.owned)) {
        const BlockEntry& other = entries[j];
        const glm::dvec3 tolerance = toleranceOf(own, other);
        if (j == i || !overlapBy(own.owned, other.owned, tolerance)) continue;
        const LevelOrder order = levelOrderOf(other, own);
        if (order == LevelOrder::Same && overlapBy(own.asked, other.asked, tolerance)) {
          const std::uint64_t pair = std::min(i, j) * entries.size() + std::max(i, j);
          const std::lock_guard lock(conflictMutex);
          conflict[0] = std::max(conflict[0], ~pair);
        }
        // If two blocks of one level have closed a gap, the first one keeps the common part.
        if (order == LevelOrder::Finer || (order == LevelOrder::Same && j < i))
          left.finer.push_back(other.owned);
      }
      left.boxes = withoutAll(own.owned, left.finer);
    }
  };
  comm.together([&] {
    parts.resize(directory.lastMine() - directory.firstMine());
    inParallel(parts.size(), blocksPerThread, settle);
  });
  comm.allReduceMax(conflict);
  if (conflict[0] != 0) {
    const std::uint64_t pair = ~conflict[0];
    throw Error(
        ErrorCode::InvalidArgument,
        fmt::format("{} and {} have the same spacing and overlap; mark ghost layers as such, and don't "
                    "pass values twice",
                    nameOf(entries[pair / entries.size()]), nameOf(entries[pair % entries.size()])));
  }
  return parts;
}

}  // namespace vdi::comm
