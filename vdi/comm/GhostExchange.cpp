#include "vdi/comm/GhostExchange.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstring>
#include <map>
#include <tuple>
#include <unordered_map>

#include "vdi/core/Error.h"

namespace vdi::comm {

namespace {

constexpr double latticeTolerance = 1e-3;  // of a spacing

/// A block as the other ranks need to know it.
struct Description {
  glm::dvec3 origin;  // of the first stored value
  glm::dvec3 spacing;
  Box owned;
  glm::ivec3 dims;
  std::uint32_t type;
  std::int32_t rank;
  std::int32_t index;  // on its rank
};

/// The values of a block that are its own to give, as a half-open box of lattice indices of its lattice. For
/// points the owned box runs from value to value, for cells from half a spacing before to half a spacing
/// behind.
struct IndexBox {
  glm::i64vec3 lo{0};
  glm::i64vec3 hi{0};
  bool empty() const { return lo.x >= hi.x || lo.y >= hi.y || lo.z >= hi.z; }
  IndexBox intersection(const IndexBox& other) const {
    return {glm::max(lo, other.lo), glm::min(hi, other.hi)};
  }
  std::uint64_t count() const {
    if (empty()) return 0;
    const auto size = glm::u64vec3(hi - lo);
    return size.x * size.y * size.z;
  }
};

/// Blocks whose values lie on one lattice: equal type and spacing, origins whole spacings apart.
struct LatticeKey {
  std::uint32_t type;
  std::array<double, 3> spacing;
  std::array<std::int64_t, 3> phase;  // origin modulo spacing, in steps of the tolerance
  bool operator<(const LatticeKey& other) const {
    return std::tie(type, spacing, phase) < std::tie(other.type, other.spacing, other.phase);
  }
};

glm::i64vec3 round64(const glm::dvec3& v) {
  return glm::i64vec3(glm::round(v));
}

LatticeKey keyOf(const Description& block, const glm::dvec3& anchor) {
  LatticeKey key{block.type, {}, {}};
  const auto steps = static_cast<std::int64_t>(std::lround(1.0 / latticeTolerance));
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    // Nine digits: spacings of one data set computed in different ways agree to more than that.
    const double magnitude = std::pow(10.0, std::floor(std::log10(block.spacing[axis])) - 9.0);
    key.spacing[a] = std::round(block.spacing[axis] / magnitude) * magnitude;
    const double position = (block.origin[axis] - anchor[axis]) / block.spacing[axis];
    const auto phase = static_cast<std::int64_t>(
        std::llround((position - std::floor(position)) * static_cast<double>(steps)));
    key.phase[a] = (phase + 1) / 2 % (steps / 2);  // neighbouring steps fall together, 1 and 0 too
  }
  return key;
}

/// Index on the anchored lattice of the block's first stored value.
glm::i64vec3 firstIndex(const Description& block, const glm::dvec3& anchor) {
  return round64((block.origin - anchor) / block.spacing);
}

IndexBox storedBox(const Description& block, const glm::dvec3& anchor) {
  const glm::i64vec3 lo = firstIndex(block, anchor);
  return {lo, lo + glm::i64vec3(block.dims)};
}

/// Stored values within the owned box, half a spacing of tolerance being far more than rounding needs.
IndexBox givenBox(const Description& block, const glm::dvec3& anchor) {
  const glm::i64vec3 first = firstIndex(block, anchor);
  IndexBox box;
  box.lo = first + glm::i64vec3(glm::ceil((block.owned.lo - block.origin) / block.spacing - 0.01));
  box.hi = first + glm::i64vec3(glm::floor((block.owned.hi - block.origin) / block.spacing + 0.01)) +
           std::int64_t{1};
  return box.intersection(storedBox(block, anchor));
}

/// Owned boxes of point data end at values, those of cell data half-way between two.
bool isCellLike(const Description& block) {
  const double position = (block.owned.lo.x - block.origin.x) / block.spacing.x;
  return std::abs(position - std::floor(position) - 0.5) < 0.25;
}

/// Blocks of one lattice by the cells of a coarse grid that they touch, so that neighbours are found without
/// comparing all pairs.
class Neighbourhood {
 public:
  Neighbourhood(std::span<const Description> blocks, std::span<const std::size_t> members,
                const glm::dvec3& anchor)
      : cell_(1) {
    for (const std::size_t i : members) cell_ = glm::max(cell_, glm::i64vec3(blocks[i].dims));
    for (const std::size_t i : members) {
      forEachCell(givenBox(blocks[i], anchor),
                  [&](const glm::i64vec3& at) { cells_[hash(at)].push_back(i); });
    }
  }
  /// Every block whose given box may intersect `box`, each once.
  std::vector<std::size_t> near(const IndexBox& box) const {
    std::vector<std::size_t> found;
    forEachCell(box, [&](const glm::i64vec3& at) {
      const auto entry = cells_.find(hash(at));
      if (entry != cells_.end()) found.insert(found.end(), entry->second.begin(), entry->second.end());
    });
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
  }

 private:
  template <typename Visit>
  void forEachCell(const IndexBox& box, Visit visit) const {
    if (box.empty()) return;
    const auto cellOf = [&](const glm::i64vec3& p) {
      return glm::i64vec3(glm::floor(glm::dvec3(p) / glm::dvec3(cell_)));
    };
    const glm::i64vec3 lo = cellOf(box.lo);
    const glm::i64vec3 hi = cellOf(box.hi - std::int64_t{1});
    for (std::int64_t z = lo.z; z <= hi.z; ++z) {
      for (std::int64_t y = lo.y; y <= hi.y; ++y) {
        for (std::int64_t x = lo.x; x <= hi.x; ++x) visit({x, y, z});
      }
    }
  }
  static std::uint64_t hash(const glm::i64vec3& p) {
    const auto u = glm::u64vec3(p);
    return u.x * 0x9E3779B97F4A7C15ULL ^ u.y * 0xC2B2AE3D27D4EB4FULL ^ u.z * 0x165667B19E3779F9ULL;
  }
  glm::i64vec3 cell_;
  std::unordered_map<std::uint64_t, std::vector<std::size_t>> cells_;
};

/// Values of `box` that travel from one block to another.
struct Transfer {
  std::size_t donor;      // in the list of all blocks
  std::size_t recipient;  // likewise
  IndexBox box;
};

/// What a block lacks, and its lattice box once it has it.
struct Plan {
  GhostLayers added;
  IndexBox grown;
  glm::bvec3 gapAbove{false};  // point data: the cell above belongs to nobody yet
};

class Exchange {
 public:
  Exchange(const Communicator& comm, std::vector<Block>& mine) : comm_(comm), mine_(mine) { describe(); }

  std::vector<Block> run() {
    group();
    planAll();
    return deliver();
  }

 private:
  void describe() {
    std::vector<Description> own;
    for (std::size_t i = 0; i < mine_.size(); ++i) {
      const Block& b = mine_[i];
      if (b.owned.empty()) continue;
      own.push_back({b.origin, b.spacing, b.owned, b.dims, static_cast<std::uint32_t>(b.type), comm_.rank(),
                     static_cast<std::int32_t>(i)});
    }
    const Gathered gathered = comm_.allGather(std::as_bytes(std::span(own)), sizeof(Description));
    all_.resize(gathered.bytes.size() / sizeof(Description));
    if (!all_.empty()) std::memcpy(all_.data(), gathered.bytes.data(), gathered.bytes.size());
    plans_.resize(all_.size());
    if (!all_.empty()) anchor_ = all_.front().origin;
  }

  void group() {
    std::map<LatticeKey, std::vector<std::size_t>> lattices;
    for (std::size_t i = 0; i < all_.size(); ++i) lattices[keyOf(all_[i], anchor_)].push_back(i);
    for (auto& [key, members] : lattices) groups_.push_back(std::move(members));
  }

  /// Every rank plans for all blocks: the plan follows from the descriptions alone, so nobody need be asked.
  void planAll() {
    for (const auto& members : groups_) {
      if (members.size() < 2) {
        for (const std::size_t i : members) plans_[i].grown = storedBox(all_[i], anchor_);
        continue;
      }
      const Neighbourhood neighbours(all_, members, anchor_);
      for (const std::size_t i : members) plan(i, neighbours);
    }
  }

  void plan(std::size_t i, const Neighbourhood& neighbours) {
    const IndexBox stored = storedBox(all_[i], anchor_);
    const IndexBox given = givenBox(all_[i], anchor_);
    const bool cells = isCellLike(all_[i]);
    Plan& plan = plans_[i];
    plan.grown = stored;
    for (int axis = 0; axis < 3; ++axis) {
      for (const bool above : {false, true}) {
        // Just beyond the given values; stored ghost layers there mean that nothing is lacking on this side.
        if (above ? stored.hi[axis] > given.hi[axis] : stored.lo[axis] < given.lo[axis]) continue;
        // Point data lacks something only above: the gap's owner is the block below it.
        if (!cells && !above) continue;
        IndexBox layer = given;
        layer.lo[axis] = above ? given.hi[axis] : given.lo[axis] - 1;
        layer.hi[axis] = layer.lo[axis] + 1;
        bool found = false;
        bool shared = false;
        for (const std::size_t n : neighbours.near(layer)) {
          if (n == i || isCellLike(all_[n]) != cells) continue;
          const IndexBox other = givenBox(all_[n], anchor_);
          if (other.intersection(layer).empty()) continue;
          // A neighbour that also has this block's last values shares a face with it: no gap there.
          IndexBox face = layer;
          face.lo[axis] += above ? -1 : 1;
          face.hi[axis] += above ? -1 : 1;
          (other.intersection(face).empty() ? found : shared) = true;
        }
        if (!found || (shared && !cells)) continue;
        (above ? plan.added.hi : plan.added.lo)[axis] = 1;
        if (!cells) plan.gapAbove[axis] = true;
      }
    }
    plan.grown.lo -= glm::i64vec3(plan.added.lo);
    plan.grown.hi += glm::i64vec3(plan.added.hi);
    if (plan.grown.lo == stored.lo && plan.grown.hi == stored.hi) return;
    for (const std::size_t n : neighbours.near(plan.grown)) {
      if (n == i || isCellLike(all_[n]) != cells) continue;
      const IndexBox part = givenBox(all_[n], anchor_).intersection(plan.grown);
      if (!part.empty()) transfers_.push_back({n, i, part});
    }
  }

  std::vector<Block> deliver() {
    const auto ranks = static_cast<std::size_t>(comm_.size());
    std::vector<std::vector<std::byte>> outgoing(ranks);
    for (const Transfer& transfer : transfers_) {
      if (all_[transfer.donor].rank != comm_.rank()) continue;
      copyOut(transfer, outgoing[static_cast<std::size_t>(all_[transfer.recipient].rank)]);
    }
    std::vector<std::byte> bytes;
    std::vector<std::uint64_t> counts;
    for (const auto& part : outgoing) {
      counts.push_back(part.size());
      bytes.insert(bytes.end(), part.begin(), part.end());
    }
    const Gathered incoming = comm_.allToAll(bytes, counts, 1);

    std::vector<Block> result = std::move(mine_);
    std::vector<std::byte*> storage(all_.size(), nullptr);
    for (std::size_t i = 0; i < all_.size(); ++i) {
      if (all_[i].rank == comm_.rank()) storage[i] = grow(i, result[static_cast<std::size_t>(all_[i].index)]);
    }
    std::vector<std::uint64_t> cursor(incoming.offsets.begin(), incoming.offsets.end() - 1);
    for (const Transfer& transfer : transfers_) {
      if (all_[transfer.recipient].rank != comm_.rank()) continue;
      std::uint64_t& at = cursor[static_cast<std::size_t>(all_[transfer.donor].rank)];
      at += copyIn(transfer, storage[transfer.recipient], incoming.bytes.data() + at);
    }
    return result;
  }

  template <typename Visit>
  static void forEachRow(const IndexBox& box, Visit visit) {
    for (std::int64_t z = box.lo.z; z < box.hi.z; ++z) {
      for (std::int64_t y = box.lo.y; y < box.hi.y; ++y) visit(y, z);
    }
  }

  static std::size_t position(const IndexBox& within, std::int64_t x, std::int64_t y, std::int64_t z) {
    const glm::i64vec3 size = within.hi - within.lo;
    return static_cast<std::size_t>(((z - within.lo.z) * size.y + (y - within.lo.y)) * size.x +
                                    (x - within.lo.x));
  }

  void copyOut(const Transfer& transfer, std::vector<std::byte>& to) const {
    const Block& donor = mine_[static_cast<std::size_t>(all_[transfer.donor].index)];
    const IndexBox stored = storedBox(all_[transfer.donor], anchor_);
    const std::size_t size = sizeOf(donor.type);
    const auto* data = static_cast<const std::byte*>(donor.data);
    forEachRow(transfer.box, [&](std::int64_t y, std::int64_t z) {
      const std::byte* row = data + position(stored, transfer.box.lo.x, y, z) * size;
      to.insert(to.end(), row, row + static_cast<std::size_t>(transfer.box.hi.x - transfer.box.lo.x) * size);
    });
  }

  std::uint64_t copyIn(const Transfer& transfer, std::byte* storage, const std::byte* from) const {
    const IndexBox& grown = plans_[transfer.recipient].grown;
    const IndexBox stored = storedBox(all_[transfer.recipient], anchor_);
    const std::size_t size = sizeOf(static_cast<ScalarType>(all_[transfer.recipient].type));
    const std::byte* const start = from;
    forEachRow(transfer.box, [&](std::int64_t y, std::int64_t z) {
      for (std::int64_t x = transfer.box.lo.x; x < transfer.box.hi.x; ++x, from += size) {
        const glm::i64vec3 at{x, y, z};
        const bool own =
            glm::all(glm::greaterThanEqual(at, stored.lo)) && glm::all(glm::lessThan(at, stored.hi));
        if (!own) std::memcpy(storage + position(grown, x, y, z) * size, from, size);
      }
    });
    return static_cast<std::uint64_t>(from - start);
  }

  /// Replaces the block by a larger copy, the new layers filled with the nearest own values. Returns the
  /// copy's storage, nullptr if the block lacked nothing.
  std::byte* grow(std::size_t i, Block& block) const {
    const Plan& plan = plans_[i];
    const IndexBox stored = storedBox(all_[i], anchor_);
    if (plan.grown.lo == stored.lo && plan.grown.hi == stored.hi) return nullptr;
    const std::size_t size = sizeOf(block.type);
    const std::shared_ptr<std::byte[]> storage(new std::byte[plan.grown.count() * size]);
    const auto* data = static_cast<const std::byte*>(block.data);
    forEachRow(plan.grown, [&](std::int64_t y, std::int64_t z) {
      const std::int64_t nearestY = std::clamp(y, stored.lo.y, stored.hi.y - 1);
      const std::int64_t nearestZ = std::clamp(z, stored.lo.z, stored.hi.z - 1);
      const std::byte* const from = data + position(stored, stored.lo.x, nearestY, nearestZ) * size;
      const std::size_t row = static_cast<std::size_t>(stored.hi.x - stored.lo.x) * size;
      std::byte* const to = storage.get() + position(plan.grown, stored.lo.x, y, z) * size;
      std::memcpy(to, from, row);
      for (std::int64_t x = plan.grown.lo.x; x < stored.lo.x; ++x)
        std::memcpy(to - static_cast<std::size_t>(stored.lo.x - x) * size, from, size);
      for (std::int64_t x = stored.hi.x; x < plan.grown.hi.x; ++x)
        std::memcpy(to + static_cast<std::size_t>(x - stored.lo.x) * size, from + row - size, size);
    });
    block.origin -= glm::dvec3(plan.added.lo) * block.spacing;
    block.dims += plan.added.lo + plan.added.hi;
    for (int axis = 0; axis < 3; ++axis) {
      if (plan.gapAbove[axis]) block.owned.hi[axis] += block.spacing[axis];
    }
    block.data = storage.get();
    block.keepAlive = std::shared_ptr<const void>(storage, storage.get());
    return storage.get();
  }

  const Communicator& comm_;
  std::vector<Block>& mine_;
  std::vector<Description> all_;
  glm::dvec3 anchor_{0.0};
  std::vector<std::vector<std::size_t>> groups_;
  std::vector<Plan> plans_;
  std::vector<Transfer> transfers_;
};

}  // namespace

std::vector<Block> exchangeGhosts(const Communicator& comm, std::vector<Block> blocks) {
  return Exchange(comm, blocks).run();
}

}  // namespace vdi::comm
