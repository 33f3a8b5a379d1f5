#include "vdi/comm/GhostExchange.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <tuple>
#include <utility>

#include "vdi/comm/BeyondDomain.h"
#include "vdi/comm/BlockDirectory.h"
#include "vdi/comm/Indices.h"
#include "vdi/comm/Remainder.h"
#include "vdi/comm/Sampler.h"
#include "vdi/core/Parallel.h"
#include "vdi/core/Scene.h"

namespace vdi::comm {

namespace {

/// Rays need values to this distance beyond an owned box, in spacings.
constexpr double reach = valueReach;

/// A tolerance in spacings, greater than the distance by which rounding and latticeTolerance move a face, but
/// less than the distance between values.
constexpr double indexTolerance = 0.01;

/// The most finer values per axis that a mean uses, even if there are more.
constexpr int maxParts = 16;

/// Gaps that are closed, and values up to `reach`, lie within this many layers around the stored values.
constexpr int maxLayers = 3;

glm::ivec3 indexOf(const glm::dvec3& index, const Block& block) {
  const glm::dvec3 beyond(maxLayers);
  return glm::ivec3(glm::clamp(index, -beyond, glm::dvec3(block.dims) + beyond));
}

/// Indices of the values for interpolation in the box and up to `reach` beyond.
IndexBox valuesFor(const Box& box, const Block& block) {
  const double beyond = reach - indexTolerance;
  return {indexOf(glm::floor((box.lo - block.origin) / block.spacing - beyond), block),
          indexOf(glm::ceil((box.hi - block.origin) / block.spacing + beyond) + 1.0, block)};
}

/// The part of a block's stored values straight beside its core, on both sides along the axis, and the core.
template <typename AnyBox>
AnyBox columnOf(const AnyBox& stored, const AnyBox& core, int axis) {
  AnyBox column = core;
  column.lo[axis] = stored.lo[axis];
  column.hi[axis] = stored.hi[axis];
  return column;
}

/// A grid's neighbours and patches take some 30 us.
constexpr std::size_t gridsPerThread = 8;

/// A question of one rank to another, or to itself. For each value in `box` of a lattice, it asks for the sum
/// over those of the value's samples that lie in `clip`, [lo, hi). A value's samples are the middles of its
/// parts. A block may need hundreds of questions.
struct Question {
  std::int32_t grid;    // on the rank that answers
  std::int32_t round;   // the round in which it is answered
  std::int32_t copied;  // 1: for copies of values, which are `shift` further in the answering grid
  glm::ivec3 shift;
  IndexBox box;
  glm::ivec3 parts;  // per axis
  Box clip;
};

/// A question with the lattice that it is about.
struct Request : Question {
  glm::dvec3 origin;
  glm::dvec3 spacing;

  double place(int axis, int index, int part) const {
    const double offset = parts[axis] == 1 ? 0.0 : (part + 0.5) / parts[axis] - 0.5;
    return origin[axis] + (index + offset) * spacing[axis];
  }
  /// The parts [first, last) of value `index` along the axis whose samples are in the clip.
  std::pair<int, int> partsIn(int axis, int index) const {
    int first = 0;
    while (first < parts[axis] && place(axis, index, first) < clip.lo[axis]) ++first;
    int last = first;
    while (last < parts[axis] && place(axis, index, last) < clip.hi[axis]) ++last;
    return {first, last};
  }
  /// Writes the places of the samples, per axis, that belong to `some` of the values and lie in the clip.
  void placesIn(const IndexBox& some, std::array<SamplePlaces, 3>& samples) const {
    for (int axis = 0; axis < 3; ++axis) {
      SamplePlaces& own = samples[static_cast<std::size_t>(axis)];
      own.clear();
      for (int index = some.lo[axis]; index < some.hi[axis]; ++index) {
        for (int part = 0; part < parts[axis]; ++part) {
          const double sample = place(axis, index, part);
          if (sample >= clip.lo[axis] && sample < clip.hi[axis]) own.places.push_back(sample);
        }
        own.endValue();
      }
    }
  }
  /// Reduces the box to values with samples in the clip.
  void trim() {
    for (int axis = 0; axis < 3; ++axis) {
      const double lo = std::floor((clip.lo[axis] - origin[axis]) / spacing[axis]) - 1.0;
      const double hi = std::ceil((clip.hi[axis] - origin[axis]) / spacing[axis]) + 2.0;
      box.lo[axis] = static_cast<int>(std::max<double>(box.lo[axis], lo));
      box.hi[axis] = static_cast<int>(std::min<double>(box.hi[axis], hi));
      const auto empty = [&](int index) {
        const auto [first, last] = partsIn(axis, index);
        return first == last;
      };
      while (box.lo[axis] < box.hi[axis] && empty(box.lo[axis])) ++box.lo[axis];
      while (box.lo[axis] < box.hi[axis] && empty(box.hi[axis] - 1)) --box.hi[axis];
    }
  }
};

/// A question with what it is for.
struct Asked {
  Question question;
  std::int32_t grid;  // the asking grid
  std::int32_t wanted;
};

/// Values that a grid lacks, or has but should not use.
struct Wanted {
  IndexBox box;
  bool keep = false;                    // the caller's ghost values, which stay if no block has better ones
  std::vector<IndexBox> asked;          // parts that other blocks have; they may overlap
  std::vector<std::size_t> questions;   // about them, among those to this rank itself
  std::vector<IndexBox> edges;          // parts that blocks store, but at edges of their ghost layers only
  std::size_t copies = 0;               // number of values to copy
  std::shared_ptr<std::byte[]> values;  // values of the block's type
  std::vector<double> sums;             // empty unless some values are means or interpolated
  std::vector<double> weights;
};

/// Values that one block or several blocks of this rank share.
struct Grid {
  Block block;
  std::shared_ptr<const Block> stored;  // its stored values alone
  bool cells = false;
  double volume = 0.0;  // volume that a single value represents
  IndexBox core;        // bounds of the stored values without ghost layers
  IndexBox used;        // bounds of all values that interpolation uses
  std::vector<Box> owned;
  std::vector<Box> finer;       // parts that finer blocks took over
  std::vector<IndexBox> given;  // its own values
  std::vector<Wanted> wanted;
  IndexBox asked;                                         // bounds of all values that other blocks have
  std::vector<std::pair<std::int32_t, Asked>> questions;  // each with the rank that answers
  std::vector<OpenPatch> open;  // places where values are continued beyond the domain's faces
  bool stale = true;            // values have arrived since the last continuation
};

/// The stored values as an array of the type.
std::shared_ptr<const void> convertedTo(ScalarType type, const Block& block) {
  const std::shared_ptr<std::byte[]> values(new std::byte[block.valueCount() * sizeOf(type)]);
  const Tiling tiles = block.tilesOf(block.stored());
  TileBuffer buffer;
  for (std::size_t i = 0; i < tiles.count(); ++i) {
    const IndexBox tile = tiles[i];
    block.copyTo(tile, buffer.bytes.data());
    std::size_t next = 0;
    forEachIndex(tile, [&](const glm::ivec3& at) {
      const double value = loadValue(block.type, buffer.bytes.data(), next++);
      storeValue(type, values.get(), block.stored().position(at), value);
    });
  }
  return {values, values.get()};
}

/// Converts all blocks of all ranks to the one type that represents all of their values.
void makeTypesOne(const Communicator& comm, std::vector<Block>& blocks) {
  std::array<std::uint64_t, 8> present{};
  for (const Block& block : blocks) present[static_cast<std::size_t>(block.type)] = 1;
  comm.allReduceMax(present);
  if (std::count(present.begin(), present.end(), 1U) <= 1) return;
  const auto has = [&](ScalarType type) { return present[static_cast<std::size_t>(type)] != 0; };
  const bool wide = has(ScalarType::U32) || has(ScalarType::I32) || has(ScalarType::F64);
  const ScalarType common = wide ? ScalarType::F64 : ScalarType::F32;
  comm.together([&] {
    using Key = std::tuple<const void*, std::array<int, 3>, std::array<std::int64_t, 3>>;
    std::map<Key, std::shared_ptr<const void>> known;
    for (Block& block : blocks) {
      if (block.type == common) continue;
      const ByteStrides strides = block.strides.value_or(ByteStrides(0));
      std::shared_ptr<const void>& copy =
          known[{block.data, {block.dims.x, block.dims.y, block.dims.z}, {strides.x, strides.y, strides.z}}];
      if (!copy) copy = convertedTo(common, block);
      block.type = common;
      block.data = copy.get();
      block.keepAlive = copy;
      block.strides.reset();
      block.computed = nullptr;
    }
  });
}

/// Collective: replaces each block by the parts that it still owns.
std::vector<Block> partsOf(const Communicator& comm, const std::vector<OwnParts>& parts,
                           std::vector<Block> blocks) {
  std::vector<Block> result;
  comm.together([&] {
    std::size_t entry = 0;
    for (Block& block : blocks) {
      if (block.owned.empty()) {
        result.push_back(std::move(block));
        continue;
      }
      assert(entry < parts.size());
      for (const Box& part : parts[entry++].boxes) result.emplace_back(block).owned = part;
    }
  });
  return result;
}

class LayerExchange {
 public:
  /// Not collective; call within together().
  LayerExchange(const Communicator& comm, const BlockDirectory& directory, const std::vector<OwnParts>& parts,
                std::vector<Block>& blocks)
      : comm_(comm),
        directory_(directory),
        blocks_(blocks),
        outgoing_(static_cast<std::size_t>(comm.size())) {
    findLevels();
    gatherGrids(parts);
    findQuestions();
    inParallel(grids_.size(), gridsPerThread, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) {
        makePatches(i);
        noteOwnValues(grids_[i]);
      }
    });
    rounds_.resize(levels_.size() + firstCoarserRound);
    for (const auto& asked : outgoing_) {
      for (const Asked& one : asked) {
        if (one.question.round != noRound) rounds_[static_cast<std::size_t>(one.question.round)] = 1;
      }
    }
  }

  /// Collective.
  void run() {
    comm_.allReduceMax(rounds_);
    if (std::count(rounds_.begin(), rounds_.end(), 1U) > 0) {
      sendRequests();
      for (std::size_t round = 0; round < rounds_.size(); ++round) {
        if (rounds_[round] != 0) exchangeValues(static_cast<std::int32_t>(round));
      }
    }
    comm_.together([&] {
      for (Grid& grid : grids_) continueBeyondDomain(grid);
    });
    for (std::size_t i = directory_.firstMine(); i < directory_.lastMine(); ++i) {
      const BlockEntry& entry = directory_.entries()[i];
      Block& block = blocks_[static_cast<std::size_t>(entry.block)];
      const Block& filled = grids_[static_cast<std::size_t>(entry.grid)].block;
      block.extra = filled.extra;
      block.patches = filled.patches;
      block.ownValues = filled.ownValues;
    }
  }

 private:
  /// The first round answers with values that coincide with a donor's own. The second one interpolates in
  /// donors of the asking level or finer ones, and later rounds interpolate in coarser ones, the coarsest
  /// first. Thus each round finds the layers that it needs.
  static constexpr std::int32_t noRound = -1;  // needs no answer
  static constexpr std::int32_t exactRound = 0;
  static constexpr std::int32_t interpolatedRound = 1;
  static constexpr std::int32_t firstCoarserRound = 2;

  void findLevels() {
    for (const BlockEntry& entry : directory_.entries()) levels_.push_back(entry.valueVolume());
    std::sort(levels_.begin(), levels_.end(), std::greater<>());
    const auto same = [](double a, double b) { return b > 0.99 * a; };
    levels_.erase(std::unique(levels_.begin(), levels_.end(), same), levels_.end());
    for (const BlockEntry& entry : directory_.entries()) levelNumbers_.push_back(levelNumber(entry));
  }

  std::int32_t levelNumber(const BlockEntry& entry) const {
    const auto isLarger = [](double level, double volume) { return level > volume / 0.99; };
    return static_cast<std::int32_t>(
        std::lower_bound(levels_.begin(), levels_.end(), entry.valueVolume(), isLarger) - levels_.begin());
  }

  void gatherGrids(const std::vector<OwnParts>& parts) {
    for (std::size_t i = directory_.firstMine(); i < directory_.lastMine(); ++i) {
      const BlockEntry& entry = directory_.entries()[i];
      const auto index = static_cast<std::size_t>(entry.grid);
      if (index >= grids_.size()) {
        Grid& grid = grids_.emplace_back();
        grid.block = blocks_[static_cast<std::size_t>(entry.block)];
        grid.block.extra = {};
        grid.block.patches = nullptr;
        grid.cells = entry.cells;
        grid.volume = entry.valueVolume();
      }
      Grid& grid = grids_[index];
      grid.core.include(grid.block.valuesIn(entry.asked));
      const OwnParts& own = parts[i - directory_.firstMine()];
      grid.owned.insert(grid.owned.end(), own.boxes.begin(), own.boxes.end());
      grid.finer.insert(grid.finer.end(), own.finer.begin(), own.finer.end());
    }
    for (Grid& grid : grids_) {
      for (const Box& box : grid.owned) {
        // A ghost value in a gap that the block has closed is not its own.
        std::vector<IndexBox> values{grid.block.valuesIn(box).intersection(grid.core)};
        // Points on a finer block's face belong to the finer block.
        for (const Box& finer : grid.finer) subtract(values, grid.block.valuesIn(finer));
        std::erase_if(values, [](const IndexBox& part) { return part.empty(); });
        grid.given.insert(grid.given.end(), values.begin(), values.end());
      }
    }
  }

  /// Finds the values around the stored ones, and stored ones that are not the grid's own but take part in
  /// interpolation.
  static void findWanted(Grid& grid) {
    const IndexBox stored = grid.block.stored();
    for (const Box& box : grid.owned) grid.used.include(valuesFor(box, grid.block));
    IndexBox all = stored;
    all.include(grid.used);
    for (const IndexBox& box : without(all, stored)) grid.wanted.emplace_back().box = box;
    const std::size_t around = grid.wanted.size();
    for (const Box& box : grid.owned) {
      std::vector<IndexBox> inside{valuesFor(box, grid.block).intersection(stored)};
      for (const IndexBox& given : grid.given) subtract(inside, given);
      for (std::size_t i = around; i < grid.wanted.size(); ++i) subtract(inside, grid.wanted[i].box);
      const auto want = [&](const IndexBox& values, bool keep) {
        Wanted& wanted = grid.wanted.emplace_back();
        wanted.box = values;
        wanted.keep = keep;
      };
      if (grid.block.masked) {
        for (const IndexBox& masked : *grid.block.masked) {
          for (const IndexBox& values : inside) {
            const IndexBox common = values.intersection(masked);
            if (!common.empty()) want(common, false);
          }
          subtract(inside, masked);
        }
      }
      for (int axis = 0; axis < 3; ++axis) {
        const IndexBox column = columnOf(stored, grid.core, axis);
        for (const IndexBox& values : inside) {
          const IndexBox common = values.intersection(column);
          if (!common.empty()) want(common, true);
        }
        subtract(inside, column);
      }
      for (const IndexBox& values : inside) {
        want(values, false);
        grid.wanted.back().edges.push_back(values);
      }
    }
  }

  /// Threads share the grids. The questions stay in the grids' order.
  void findQuestions() {
    inParallel(grids_.size(), gridsPerThread, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) {
        Grid& grid = grids_[i];
        findWanted(grid);
        for (std::size_t w = 0; w < grid.wanted.size(); ++w) askFor(i, w);
        grid.stored = storedOnly(grid.block);
      }
    });
    for (Grid& grid : grids_) {
      for (const auto& [rank, asked] : grid.questions) {
        std::vector<Asked>& questions = outgoing_[static_cast<std::size_t>(rank)];
        if (rank == comm_.rank())
          grid.wanted[static_cast<std::size_t>(asked.wanted)].questions.push_back(questions.size());
        questions.push_back(asked);
      }
      grid.questions = {};
    }
  }

  /// Finds the blocks that have the values, the finest first.
  void askFor(std::size_t gridIndex, std::size_t wantedIndex) {
    const Grid& grid = grids_[gridIndex];
    const IndexBox values = grid.wanted[wantedIndex].box;
    // The volume that the values represent.
    const Box volume{grid.block.origin + (glm::dvec3(values.lo) - 0.5) * grid.block.spacing,
                     grid.block.origin + (glm::dvec3(values.hi) - 0.5) * grid.block.spacing};
    // The owners of a place come first, the finest first; within a level, blocks with a value there precede
    // those that only close a gap. Owners claim the places of their values. Offsets leave places between
    // levels that no values represent; the owners of the space claim these. Ghost values come last, for
    // places that nobody owns.
    enum class By { Values, Gap, Space };
    using Claim = std::tuple<bool, std::int32_t, By, std::size_t>;  // Space; level, negative; by; donor
    const bool hasOffset = grid.block.offset != glm::dvec3(0.0);
    const std::vector<std::size_t> donors = directory_.meeting(volume);
    std::vector<Claim> owners;
    for (const std::size_t d : donors) {
      const BlockEntry& donor = directory_.entries()[d];
      if (isOf(gridIndex, donor)) continue;
      owners.emplace_back(false, -levelNumbers_[d], By::Values, d);
      if (donor.asked != donor.owned) owners.emplace_back(false, -levelNumbers_[d], By::Gap, d);
      if (hasOffset && levels_.size() > 1) owners.emplace_back(true, -levelNumbers_[d], By::Space, d);
    }
    std::sort(owners.begin(), owners.end());
    Remainder left(volume);
    for (const auto& [last, level, by, d] : owners) {
      if (left.empty()) return;
      const BlockEntry& donor = directory_.entries()[d];
      const Box owned = by == By::Values ? donor.asked : donor.owned;
      claim(left, gridIndex, d, by == By::Space ? owned : donor.ofValues(owned),
            [&, donor = d](const Box& common) { ask(gridIndex, wantedIndex, donor, common); });
    }
    if (!left.empty()) askForGhosts(gridIndex, wantedIndex, donors, left);
  }

  bool isOf(std::size_t gridIndex, const BlockEntry& entry) const {
    return entry.rank == comm_.rank() && static_cast<std::size_t>(entry.grid) == gridIndex;
  }

  /// Subtracts a donor's box with a margin, so that nothing is lost between faces and places that were
  /// computed differently.
  template <typename Visit>
  void claim(Remainder& left, std::size_t gridIndex, std::size_t donor, const Box& box, Visit visit) const {
    const glm::dvec3 spare =
        latticeTolerance * glm::min(directory_.entries()[donor].spacing, grids_[gridIndex].block.spacing);
    left.subtract({box.lo - spare, box.hi + spare}, visit);
  }

  /// Finds the blocks that have ghost values at places that nobody owns. Only values straight beside a block
  /// count. Where layers lie beside two blocks, all ranks choose the same one, however the ranks share the
  /// blocks: the finest, then the one beside which they lie along the first axis.
  void askForGhosts(std::size_t gridIndex, std::size_t wantedIndex, std::span<const std::size_t> donors,
                    Remainder& left) {
    // Level, negative; axis; lower corner, z first; donor.
    using Claim = std::tuple<std::int32_t, int, std::array<double, 3>, std::size_t>;
    std::vector<Claim> claims;
    const Grid& grid = grids_[gridIndex];
    const bool keep = grid.wanted[wantedIndex].keep;
    for (const std::size_t d : donors) {
      const BlockEntry& donor = directory_.entries()[d];
      if (isOf(gridIndex, donor) ? !keep : donor.masks) continue;
      const Box stored = donor.storedBox();
      const Box core = donor.ofValues(donor.asked);
      for (int axis = 0; axis < 3; ++axis) {
        if (stored.lo[axis] < core.lo[axis] || stored.hi[axis] > core.hi[axis])
          claims.emplace_back(-levelNumbers_[d], axis,
                              std::array{donor.asked.lo.z, donor.asked.lo.y, donor.asked.lo.x}, d);
      }
    }
    std::sort(claims.begin(), claims.end());
    for (const auto& [level, axis, corner, d] : claims) {
      if (left.empty()) return;
      const BlockEntry& donor = directory_.entries()[d];
      Box column = columnOf(donor.storedBox(), donor.ofValues(donor.asked), axis);
      if (grid.cells && donor.valueVolume() < 0.99 * grid.volume) shrinkToCells(column, axis, grid.block);
      claim(left, gridIndex, d, column, [&, donor = d](const Box& common) {
        if (!isOf(gridIndex, directory_.entries()[donor])) ask(gridIndex, wantedIndex, donor, common);
      });
    }
    if (keep) return;
    for (const std::size_t d : donors) {
      const BlockEntry& donor = directory_.entries()[d];
      if (isOf(gridIndex, donor) || donor.masks) continue;
      claim(left, gridIndex, d, donor.storedBox(),
            [&](const Box& common) { addEdge(gridIndex, wantedIndex, common); });
    }
  }

  /// Leaves out cells of the block that the box covers in part. A mean over that part would lie askew.
  static void shrinkToCells(Box& box, int axis, const Block& block) {
    const double spacing = block.spacing[axis];
    const double first = block.origin[axis] - 0.5 * spacing;
    box.lo[axis] = first + std::ceil((box.lo[axis] - first) / spacing - indexTolerance) * spacing;
    box.hi[axis] = first + std::floor((box.hi[axis] - first) / spacing + indexTolerance) * spacing;
  }

  void addEdge(std::size_t gridIndex, std::size_t wantedIndex, const Box& where) {
    Grid& grid = grids_[gridIndex];
    Wanted& wanted = grid.wanted[wantedIndex];
    Request places{
        {0, 0, 0, glm::ivec3(0), wanted.box, glm::ivec3(1), where}, grid.block.origin, grid.block.spacing};
    places.trim();
    if (!places.box.empty()) wanted.edges.push_back(places.box);
  }

  void ask(std::size_t gridIndex, std::size_t wantedIndex, std::size_t donorIndex, const Box& where) {
    const BlockEntry& donor = directory_.entries()[donorIndex];
    Grid& grid = grids_[gridIndex];
    Wanted& wanted = grid.wanted[wantedIndex];
    const double ratio = donor.valueVolume() / grid.volume;
    const bool finer = ratio < 0.99;
    const bool coarser = ratio > 1.0 / 0.99;
    Request request{{donor.grid, exactRound, 0, glm::ivec3(0), wanted.box, glm::ivec3(1), where},
                    grid.block.origin,
                    grid.block.spacing};
    if (grid.cells && finer && !grid.block.nearest) {
      const glm::dvec3 parts = glm::round(grid.block.spacing / donor.spacing);
      request.parts = glm::ivec3(glm::clamp(parts, glm::dvec3(1.0), glm::dvec3(maxParts)));
    }
    request.trim();
    if (request.box.empty()) return;
    const bool coincides = findShift(request, donor);
    request.copied = coincides && request.parts == glm::ivec3(1) ? 1 : 0;
    if (!coincides)
      request.round = coarser ? firstCoarserRound + levelNumbers_[donorIndex] : interpolatedRound;
    wanted.asked.push_back(request.box);
    grid.asked.include(request.box);
    if (request.copied != 0) {
      wanted.copies += request.box.count();
    } else if (wanted.sums.empty()) {
      wanted.sums.assign(wanted.box.count(), 0.0);
      wanted.weights.assign(wanted.box.count(), 0.0);
    }
    grid.questions.emplace_back(donor.rank, Asked{request, static_cast<std::int32_t>(gridIndex),
                                                  static_cast<std::int32_t>(wantedIndex)});
  }

  /// This rank's questions to itself.
  std::vector<Asked>& mine() { return outgoing_[static_cast<std::size_t>(comm_.rank())]; }

  static std::shared_ptr<const Block> storedOnly(const Block& block) {
    Block stored = block;
    stored.extra = {};
    stored.patches = nullptr;
    return std::make_shared<const Block>(std::move(stored));
  }

  /// Adds the patches of values that other blocks of this rank have, which then need no memory and no
  /// answers. Returns false unless the box, all of `wanted` that is needed, consists of such values alone.
  bool takeWhereTheyLie(const Wanted& wanted, const IndexBox& box, std::vector<Patch>& patches) {
    if (wanted.questions.size() != wanted.asked.size() || !wanted.sums.empty() ||
        wanted.copies != box.count())
      return false;
    // Faces may make boxes overlap by a rounding error, where the last answer counts.
    for (std::size_t i = 0; i < wanted.asked.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j)
        if (!wanted.asked[i].intersection(wanted.asked[j]).empty()) return false;
    }
    for (const std::size_t index : wanted.questions) {
      Question& question = mine()[index].question;
      patches.push_back(
          {question.box, nullptr, grids_[static_cast<std::size_t>(question.grid)].stored, question.shift});
      question.round = noRound;
    }
    return true;
  }

  /// Whether all samples lie at the donor's values.
  static bool findShift(Request& request, const BlockEntry& donor) {
    for (int axis = 0; axis < 3; ++axis) {
      const int last = request.parts[axis] - 1;
      const double begin =
          (request.place(axis, request.box.lo[axis], 0) - donor.origin[axis]) / donor.spacing[axis];
      const double end =
          (request.place(axis, request.box.hi[axis] - 1, last) - donor.origin[axis]) / donor.spacing[axis];
      const double steps = static_cast<double>(request.box.size()[axis]) * request.parts[axis] - 1.0;
      if (std::abs(begin - std::round(begin)) > latticeTolerance ||
          std::abs(end - std::round(end)) > latticeTolerance || std::round(end) - std::round(begin) != steps)
        return false;
      if (std::round(begin) < 0.0 || std::round(end) >= donor.dims[axis]) return false;
      request.shift[axis] = static_cast<int>(std::round(begin)) - request.box.lo[axis];
    }
    return true;
  }

  /// Makes layers where any block has values. Places without a value get the nearest own value.
  void makePatches(std::size_t gridIndex) {
    Grid& grid = grids_[gridIndex];
    const IndexBox stored = grid.block.stored();
    IndexBox all = stored;
    all.include(grid.asked);
    const bool continued = continuesBeyondDomain(grid);
    if (continued) {
      for (const Wanted& wanted : grid.wanted) all.include(wanted.box);
    }
    grid.block.extra = {-all.lo, all.hi - stored.hi};
    auto patches = std::make_shared<std::vector<Patch>>();
    for (Wanted& wanted : grid.wanted) {
      if (wanted.keep && wanted.asked.empty()) continue;
      const IndexBox box = wanted.box.intersection(all);
      if (box.empty()) continue;
      if (takeWhereTheyLie(wanted, box, *patches)) continue;
      wanted.values = std::shared_ptr<std::byte[]>(new std::byte[box.count() * sizeOf(grid.block.type)]);
      if (box != wanted.box) {
        wanted.box = box;
        if (!wanted.sums.empty()) {
          wanted.sums.assign(box.count(), 0.0);
          wanted.weights.assign(box.count(), 0.0);
        }
      }
      if (wanted.copies != box.count()) {
        fillWithOwn(grid, wanted);
        addOpen(grid, wanted, continued && box.intersection(stored).empty());
      }
      patches->push_back({box, std::shared_ptr<const void>(wanted.values, wanted.values.get())});
    }
    if (!patches->empty()) grid.block.patches = std::move(patches);
  }

  static void noteOwnValues(Grid& grid) {
    auto own = std::make_shared<OwnValues>();
    own->boxes = grid.given;
    if (grid.block.masked) {
      for (const IndexBox& masked : *grid.block.masked) subtract(own->boxes, masked);
    }
    own->used = grid.used;
    grid.block.ownValues = std::move(own);
  }

  /// Cells of several levels end at different distances from the domain's faces. With a single level, the
  /// outermost values extend to the faces, as in ParaView's own volume rendering.
  bool continuesBeyondDomain(const Grid& grid) const {
    return grid.cells && levels_.size() > 1 && !grid.block.nearest;
  }

  /// Adds the places of `wanted` that no block has: all of them, or those at edges only.
  static void addOpen(Grid& grid, const Wanted& wanted, bool all) {
    std::vector<IndexBox> open = all ? std::vector<IndexBox>{wanted.box} : wanted.edges;
    for (IndexBox& part : open) part = part.intersection(wanted.box).intersection(grid.used);
    for (const IndexBox& asked : wanted.asked) subtract(open, asked);
    std::erase_if(open, [](const IndexBox& part) { return part.empty(); });
    if (!open.empty()) grid.open.push_back({wanted.box, wanted.values.get(), std::move(open)});
  }

  /// Other levels interpolate in the continued values, which depend on received ones. So this runs before
  /// values beyond the stored ones are read, and after the last round.
  static void continueBeyondDomain(Grid& grid) {
    if (grid.stale && !grid.open.empty()) {
      comm::continueBeyondDomain(grid.block, grid.core, grid.used, grid.open);
    }
    grid.stale = false;
  }

  /// Fills `wanted` with the stored values if these must stay, else with the grid's nearest own values.
  static void fillWithOwn(const Grid& grid, Wanted& wanted) {
    const IndexBox stored = grid.block.stored();
    const bool all = wanted.keep || grid.given.empty();
    const std::span<const IndexBox> sources = all ? std::span(&stored, 1) : std::span(grid.given);
    const std::size_t size = sizeOf(grid.block.type);
    forEachRow(wanted.box, [&](const glm::ivec3& row) {
      for (glm::ivec3 at = row; at.x < wanted.box.hi.x;) {
        const IndexBox& source = nearestOf(sources, at);
        IndexBox run{at, at + 1};
        while (run.hi.x < wanted.box.hi.x && &nearestOf(sources, {run.hi.x, at.y, at.z}) == &source)
          ++run.hi.x;
        copyNearest(grid.block, source, run, wanted.values.get() + wanted.box.position(at) * size);
        at.x = run.hi.x;
      }
    });
  }

  /// The nearest box in steps along the axes; the first one in a tie.
  static const IndexBox& nearestOf(std::span<const IndexBox> boxes, const glm::ivec3& at) {
    if (boxes.size() == 1) return boxes.front();
    const auto stepsTo = [&at](const IndexBox& box) {
      const glm::ivec3 apart = glm::abs(glm::clamp(at, box.lo, box.hi - 1) - at);
      return apart.x + apart.y + apart.z;
    };
    const auto isNearer = [&](const IndexBox& a, const IndexBox& b) { return stepsTo(a) < stepsTo(b); };
    return *std::min_element(boxes.begin(), boxes.end(), isNearer);
  }

  /// Writes, for each index of the row `run`, the value of `from` that is nearest to it.
  static void copyNearest(const Block& block, const IndexBox& from, const IndexBox& run, std::byte* to) {
    const glm::ivec3 first = glm::clamp(run.lo, from.lo, from.hi - 1);
    const glm::ivec3 last = glm::clamp(run.hi - 1, from.lo, from.hi - 1);
    const std::size_t size = sizeOf(block.type);
    const auto placeOf = [&](int x) { return to + static_cast<std::size_t>(x - run.lo.x) * size; };
    const int begin = std::clamp(first.x, run.lo.x, run.hi.x - 1);
    const int end = begin + last.x + 1 - first.x;
    block.copyTo({first, last + 1}, placeOf(begin));
    for (int x = run.lo.x; x < begin; ++x) std::memcpy(placeOf(x), placeOf(begin), size);
    for (int x = end; x < run.hi.x; ++x) std::memcpy(placeOf(x), placeOf(end - 1), size);
  }

  Request requestOf(const Asked& asked) const {
    const Block& block = grids_[static_cast<std::size_t>(asked.grid)].block;
    return {asked.question, block.origin, block.spacing};
  }

  /// Sends the requests to other ranks, but not those to this rank itself.
  void sendRequests() {
    std::vector<Request> requests;
    std::vector<std::uint64_t> counts;
    comm_.together([&] {
      counts.resize(outgoing_.size());
      for (std::size_t rank = 0; rank < outgoing_.size(); ++rank) {
        if (static_cast<int>(rank) == comm_.rank()) continue;
        counts[rank] = outgoing_[rank].size();
        for (const Asked& one : outgoing_[rank]) requests.push_back(requestOf(one));
      }
    });
    incoming_ = comm_.allToAll(std::as_bytes(std::span(requests)), counts, sizeof(Request));
  }

  /// Answers travel in units of 8 bytes, and each begins at a unit.
  static constexpr std::size_t unit = 8;
  static std::size_t answerBytes(const Question& question, ScalarType type) {
    const std::size_t each = question.copied != 0 ? sizeOf(type) : sizeof(double);
    return (question.box.count() * each + unit - 1) / unit * unit;
  }

  void exchangeValues(std::int32_t round) {
    Answers remote;
    Answers own;
    std::vector<std::uint64_t> counts;
    comm_.together([&] {
      for (int rank = 0; rank < comm_.size(); ++rank) {
        const std::size_t before = remote.end;
        const std::span<const std::byte> requests = incoming_.of(rank);
        for (std::size_t at = 0; at < requests.size(); at += sizeof(Request)) {
          Request request;
          std::memcpy(&request, requests.data() + at, sizeof(Request));
          if (request.round == round) addTo(remote, request);
        }
        counts.push_back((remote.end - before) / unit);
      }
      for (const Asked& asked : outgoing_[static_cast<std::size_t>(comm_.rank())]) {
        if (asked.question.round == round) addTo(own, requestOf(asked));
      }
      answerAll(remote);
      answerAll(own);
    });
    const Gathered answers = comm_.allToAll(remote.bytes, counts, unit);
    comm_.together([&] {
      for (int rank = 0; rank < comm_.size(); ++rank) {
        const std::byte* from = rank == comm_.rank() ? own.bytes.data() : answers.of(rank).data();
        for (const Asked& asked : outgoing_[static_cast<std::size_t>(rank)]) {
          if (asked.question.round != round) continue;
          Grid& grid = grids_[static_cast<std::size_t>(asked.grid)];
          const Request request = requestOf(asked);
          take(request, grid, grid.wanted[static_cast<std::size_t>(asked.wanted)], from);
          from += answerBytes(request, grid.block.type);
        }
      }
    });
  }

  /// Requests of a round, and the answers one after the other.
  struct Answers {
    std::vector<std::pair<Request, std::size_t>> copies;  // each with the place of its answer
    std::vector<std::pair<Request, std::size_t>> sums;
    std::size_t end = 0;
    std::vector<std::byte> bytes;
  };

  void addTo(Answers& answers, const Request& request) const {
    (request.copied != 0 ? answers.copies : answers.sums).emplace_back(request, answers.end);
    answers.end += answerBytes(request, grids_[static_cast<std::size_t>(request.grid)].block.type);
  }

  /// Threads share the copies.
  void answerAll(Answers& answers) {
    answers.bytes.resize(answers.end);
    constexpr std::size_t minimum = 32;  // copies of faces that take some 100 us
    inParallel(answers.copies.size(), minimum, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) {
        const auto& [request, place] = answers.copies[i];
        const Block& block = grids_[static_cast<std::size_t>(request.grid)].block;
        block.copyTo({request.box.lo + request.shift, request.box.hi + request.shift},
                     answers.bytes.data() + place);
      }
    });
    for (const auto& [request, place] : answers.sums) sumUp(request, answers.bytes.data() + place);
  }

  void sumUp(const Request& request, std::byte* to) {
    Grid& grid = grids_[static_cast<std::size_t>(request.grid)];
    const Tiling tiles(request.box, 0);  // bounds the memory for gathered values
    for (std::size_t i = 0; i < tiles.count(); ++i) {
      const IndexBox tile = tiles[i];
      request.placesIn(tile, places_);
      sampler_.prepare(grid.block, places_);
      if (sampler_.leaves(grid.core)) continueBeyondDomain(grid);
      sampler_.gather();
      forEachIndex(tile, [&](const glm::ivec3& at) {
        const double sum = sampler_.sum(at - tile.lo);
        std::memcpy(to + request.box.position(at) * sizeof(sum), &sum, sizeof(sum));
      });
    }
  }

  void take(const Request& request, Grid& grid, Wanted& wanted, const std::byte* from) {
    grid.stale = true;
    const ScalarType type = grid.block.type;
    const std::size_t size = sizeOf(type);
    if (wanted.sums.empty()) {
      const std::size_t row = static_cast<std::size_t>(request.box.size().x) * size;
      forEachRow(request.box, [&](const glm::ivec3& at) {
        std::memcpy(wanted.values.get() + wanted.box.position(at) * size, from, row);
        from += row;
      });
      return;
    }
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double>& own = shares_[static_cast<std::size_t>(axis)];
      own.clear();
      for (int index = request.box.lo[axis]; index < request.box.hi[axis]; ++index) {
        const auto [first, last] = request.partsIn(axis, index);
        own.push_back(static_cast<double>(last - first) / request.parts[axis]);
      }
    }
    const double each = 1.0 / (static_cast<double>(request.parts.x) * request.parts.y * request.parts.z);
    std::size_t index = 0;
    forEachIndex(request.box, [&](const glm::ivec3& at) {
      double sum = 0.0;
      if (request.copied != 0) {
        sum = loadValue(type, from, index);
      } else {
        std::memcpy(&sum, from + index * sizeof(sum), sizeof(sum));
      }
      ++index;
      const std::size_t place = wanted.box.position(at);
      wanted.sums[place] += sum * each;
      const glm::u64vec3 number(at - request.box.lo);
      wanted.weights[place] += shares_[0][number.x] * shares_[1][number.y] * shares_[2][number.z];
      storeValue(type, wanted.values.get(), place, wanted.sums[place] / wanted.weights[place]);
    });
  }

  const Communicator& comm_;
  const BlockDirectory& directory_;
  std::vector<Block>& blocks_;
  std::vector<double> levels_;              // volumes of a value, descending
  std::vector<std::int32_t> levelNumbers_;  // index in levels_ of each of the directory's entries
  std::vector<Grid> grids_;
  std::vector<std::vector<Asked>> outgoing_;   // requests, by the rank that answers
  std::vector<std::uint64_t> rounds_;          // 1 for each round in which a rank wants values
  Gathered incoming_;                          // requests of other ranks
  std::array<SamplePlaces, 3> places_;         // memory for one answer at a time
  std::array<std::vector<double>, 3> shares_;  // per axis, the share of each value's parts in an answer
  Sampler sampler_;
};

}  // namespace

std::vector<Block> settleOwnership(const Communicator& comm, std::vector<Block> blocks) {
  const BlockDirectory directory(comm, blocks, false);
  const std::vector<OwnParts> parts = settleOverlaps(comm, directory);
  return partsOf(comm, parts, std::move(blocks));
}

std::vector<Block> exchangeGhosts(const Communicator& comm, std::vector<Block> blocks) {
  makeTypesOne(comm, blocks);
  const BlockDirectory directory(comm, blocks, true);
  const std::vector<OwnParts> parts = settleOverlaps(comm, directory);
  std::optional<LayerExchange> layers;
  comm.together([&] { layers.emplace(comm, directory, parts, blocks); });
  layers->run();
  return partsOf(comm, parts, std::move(blocks));
}

}  // namespace vdi::comm
