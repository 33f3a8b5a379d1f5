// Ghost layers: the values between disjoint blocks, on whichever rank the neighbours are.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "tests/Catch.h"
#include "tests/Layouts.h"
#include "vdi/comm/GhostExchange.h"
#include "vdi/synthetic/Decomposition.h"

using namespace vdi;
using comm::Communicator;

namespace {

using Field = std::function<double(const glm::dvec3&)>;

/// A different value at each lattice index, exact in all types used here.
double marker(const glm::ivec3& index) {
  return index.x + 20 * index.y + 400 * index.z;
}

template <typename ValueAt = double (*)(const glm::ivec3&)>
std::vector<Block> decomposed(const synthetic::Lattice& lattice, const glm::ivec3& blocks,
                              synthetic::Layout layout, const Communicator& world,
                              ValueAt valueAtIndex = marker) {
  std::vector<Block> mine;
  for (const synthetic::Part& part :
       synthetic::decompose(lattice.size, blocks, layout, lattice.joint, world.size(), 11)) {
    if (part.owner == world.rank()) mine.push_back(synthetic::makeBlock(lattice, part, valueAtIndex));
  }
  return mine;
}

/// The place of the lattice's value with this index.
glm::dvec3 placeIn(const synthetic::Lattice& lattice, const glm::ivec3& index) {
  const double half = lattice.joint == synthetic::Joint::Cells ? 0.5 : 0.0;
  return lattice.origin + (glm::dvec3(index) + half) * lattice.spacing;
}

glm::ivec3 indexOf(const synthetic::Lattice& lattice, const glm::dvec3& position) {
  const double half = lattice.joint == synthetic::Joint::Cells ? 0.5 : 0.0;
  return glm::ivec3(glm::round((position - lattice.origin) / lattice.spacing - half));
}

template <typename Visit>
void forEachValue(const IndexBox& box, Visit visit) {
  for (int k = box.lo.z; k < box.hi.z; ++k) {
    for (int j = box.lo.y; j < box.hi.y; ++j) {
      for (int i = box.lo.x; i < box.hi.x; ++i) visit(glm::ivec3(i, j, k));
    }
  }
}

glm::dvec3 placeOf(const Block& block, const glm::ivec3& index) {
  return block.origin + glm::dvec3(index) * block.spacing;
}

/// Checks that every value, layers included, is the right one, and that layers reach as far as rays need them
/// wherever there is a neighbour.
void checkValues(const synthetic::Lattice& lattice, const Block& block) {
  int wrong = 0;
  forEachValue(block.extended(), [&](const glm::ivec3& at) {
    if (valueAt(block, at.x, at.y, at.z) != marker(indexOf(lattice, placeOf(block, at)))) ++wrong;
  });
  CHECK(wrong == 0);
  const bool cells = lattice.joint == synthetic::Joint::Cells;
  const glm::dvec3 end = lattice.origin + glm::dvec3(lattice.size - (cells ? 0 : 1)) * lattice.spacing;
  const glm::dvec3 first = placeOf(block, block.extended().lo);
  const glm::dvec3 last = placeOf(block, block.extended().hi - 1);
  const glm::dvec3 beyond = (cells ? 0.49 : 0.99) * lattice.spacing;
  for (int axis = 0; axis < 3; ++axis) {
    const double inner = lattice.origin[axis] + beyond[axis];
    if (block.owned.lo[axis] > inner) CHECK(first[axis] <= block.owned.lo[axis] - beyond[axis]);
    if (block.owned.hi[axis] < end[axis] - beyond[axis])
      CHECK(last[axis] >= block.owned.hi[axis] + beyond[axis]);
  }
}

}  // namespace

TEST_CASE("blocks of a whole lattice get their neighbours' values, and all of space has one owner") {
  const Communicator world = Communicator::world();
  const auto joint = GENERATE(synthetic::Joint::Gap, synthetic::Joint::Cells, synthetic::Joint::SharedPoints);
  const auto layout =
      GENERATE(synthetic::Layout::Interleaved, synthetic::Layout::Random, synthetic::Layout::OnOneRank);
  const auto type = GENERATE(ScalarType::U16, ScalarType::F32, ScalarType::F64);
  const synthetic::Lattice lattice{{13, 9, 11}, {-3.0, 1e3, 0.1}, {0.1, 2.0, 1.0 / 3.0}, type, joint};
  const std::vector<Block> before = decomposed(lattice, {3, 2, 4}, layout, world);
  const std::vector<Block> after = comm::exchangeGhosts(world, before);
  REQUIRE(after.size() == before.size());
  double volume = 0.0;  // owned by this rank, then by all
  for (std::size_t i = 0; i < after.size(); ++i) {
    checkValues(lattice, after[i]);
    const glm::dvec3 size = after[i].owned.size();
    volume += size.x * size.y * size.z;
    CHECK(after[i].data == before[i].data);
  }
  const glm::dvec3 extent =
      glm::dvec3(lattice.size - (joint == synthetic::Joint::Cells ? 0 : 1)) * lattice.spacing;
  world.allReduceSum(std::span(&volume, 1));
  CHECK(volume == Approx(extent.x * extent.y * extent.z));
}

TEST_CASE("values get around in any layout, also where ranks' types differ") {
  const Communicator world = Communicator::world();
  const auto joint = GENERATE(synthetic::Joint::Gap, synthetic::Joint::Cells);
  const bool mixed = GENERATE(false, true);
  synthetic::Lattice lattice{{13, 9, 11}, {-3.0, 1e3, 0.1}, {0.1, 2.0, 1.0 / 3.0}, ScalarType::F32, joint};
  if (mixed && world.rank() % 2 == 1) lattice.type = ScalarType::U16;
  const std::vector<Block> before = decomposed(lattice, {3, 2, 4}, synthetic::Layout::Random, world);
  for (const test::Layout& layout : test::layouts()) {
    INFO(layout.name);
    std::vector<Block> laidOut = before;
    for (Block& block : laidOut) block = test::laidOut(block, layout);
    const std::vector<Block> after = comm::exchangeGhosts(world, laidOut);
    REQUIRE(after.size() == before.size());
    for (std::size_t i = 0; i < after.size(); ++i) {
      checkValues(lattice, after[i]);
      if (!mixed) CHECK(after[i].data == laidOut[i].data);
    }
  }
}

TEST_CASE("blocks of one address that differ by strides are blocks of their own") {
  const Communicator world = Communicator::world();
  std::vector<float> values(2 * 27);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i);
  std::vector<Block> blocks;
  if (world.rank() == 0) {
    for (int b = 0; b < 2; ++b) {
      blocks.push_back(Block::fromCells(glm::ivec3(3), {3.0 * b, 0.0, 0.0}, glm::dvec3(1.0), ScalarType::F32,
                                        values.data()));
    }
    blocks[1].setStrides({8, 24, 72});
  }
  const std::vector<Block> after = comm::exchangeGhosts(world, blocks);
  if (world.rank() != 0) return;
  CHECK(valueAt(after[0], 3, 1, 1) == 2.0 * (3 + 9));  // the other block's first
  CHECK(valueAt(after[1], -1, 1, 1) == 2.0 + 3 + 9);
}

/// The block with ghost layers on all sides. `halo(index, outside)` gives their values; the index is relative
/// to the block's first value, and lies outside the block along `outside` axes.
template <typename Halo>
Block withHalo(const Block& block, bool cells, int layers, Halo halo) {
  const glm::ivec3 dims = block.dims + 2 * layers;
  const IndexBox all{glm::ivec3(0), dims};
  const auto values = std::make_shared<std::vector<double>>(all.count());
  forEachValue(all, [&](const glm::ivec3& at) {
    const glm::ivec3 own = at - layers;
    int outside = 0;
    for (int axis = 0; axis < 3; ++axis) outside += own[axis] < 0 || own[axis] >= block.dims[axis] ? 1 : 0;
    (*values)[all.position(at)] = outside > 0 ? halo(own, outside) : valueAt(block, own.x, own.y, own.z);
  });
  const glm::dvec3 corner = block.origin - (layers + (cells ? 0.5 : 0.0)) * block.spacing;
  const GhostLayers ghosts{glm::ivec3(layers), glm::ivec3(layers)};
  Block wide = cells
                   ? Block::fromCells(dims, corner, block.spacing, ScalarType::F64, values->data(), ghosts)
                   : Block::fromPoints(dims, corner, block.spacing, ScalarType::F64, values->data(), ghosts);
  wide.keepAlive = values;
  return wide;
}

constexpr double unset = std::numeric_limits<double>::quiet_NaN();

/// Ghost layers that the simulation announces but never fills.
Block withUnsetHalo(const Block& block, bool cells) {
  return withHalo(block, cells, 1, [](const glm::ivec3&, int) { return unset; });
}

/// Ghost layers as a star stencil's exchange leaves them: values straight beside the block are set, and those
/// at edges and corners are not. They depend on the lattice, not on its division into blocks.
Block withStarHalo(const Block& block, bool cells, int layers, const Field& field) {
  return withHalo(block, cells, layers, [&](const glm::ivec3& own, int outside) {
    return outside > 1 ? unset : field(placeOf(block, own));
  });
}

/// The value that interpolation finds at a place of the block's lattice.
double valueAtPlace(const Block& block, const glm::dvec3& place) {
  const IndexBox all = block.extended();
  const glm::ivec3 index(glm::round((place - block.origin) / block.spacing));
  const glm::ivec3 at = glm::clamp(index, all.lo, all.hi - 1);
  return valueAt(block, at.x, at.y, at.z);
}

TEST_CASE("values off points and cells' middles come from the blocks that own them") {
  const Communicator world = Communicator::world();
  const auto offset =
      GENERATE(glm::dvec3(-0.5, 0.0, 0.0), glm::dvec3(0.0, 0.5, 0.0), glm::dvec3(-0.5, -0.5, 0.0),
               glm::dvec3(0.5, 0.0, -0.5), glm::dvec3(-0.5), glm::dvec3(0.5), glm::dvec3(0.2, -0.5, -0.35));
  const auto joint = GENERATE(synthetic::Joint::Cells, synthetic::Joint::SharedPoints);
  const bool cells = joint == synthetic::Joint::Cells;
  const bool halo = GENERATE(false, true);
  const synthetic::Lattice lattice{{12, 10, 8}, {1.0, -2.0, 0.0}, {0.5, 1.0, 2.0}, ScalarType::F64, joint};
  std::vector<Block> before = decomposed(lattice, {3, 2, 2}, synthetic::Layout::Random, world);
  for (Block& block : before) {
    if (halo) block = withUnsetHalo(block, cells);
    block.moveValues(offset);
  }
  const std::vector<Block> after = comm::exchangeGhosts(world, before);
  // The positions of the lattice's first and last values.
  const glm::dvec3 first = lattice.origin + ((cells ? 0.5 : 0.0) + offset) * lattice.spacing;
  const glm::dvec3 last = first + glm::dvec3(lattice.size - 1) * lattice.spacing;
  REQUIRE(after.size() == before.size());
  INFO("offset " << offset.x << ' ' << offset.y << ' ' << offset.z << ", halo " << halo << ", cells "
                 << cells);
  for (const Block& block : after) {
    int wrong = 0;
    int missing = 0;
    int beyond = 0;
    forEachValue(block.extended(), [&](const glm::ivec3& at) {
      const glm::dvec3 index = (placeOf(block, at) - first) / lattice.spacing;
      if (glm::any(glm::lessThan(index, glm::dvec3(-0.01))) ||
          glm::any(glm::greaterThan(index, glm::dvec3(lattice.size) - 0.99))) {
        ++beyond;
      } else {
        wrong += valueAt(block, at.x, at.y, at.z) == marker(glm::ivec3(glm::round(index))) ? 0 : 1;
      }
    });
    // All values that rays use around the owned box, as far as there are any.
    for (int axis = 0; axis < 3; ++axis) {
      const double lo = placeOf(block, block.extended().lo)[axis];
      const double hi = placeOf(block, block.extended().hi - 1)[axis];
      const double reach = 0.99 * lattice.spacing[axis];
      missing += lo <= std::max(block.owned.lo[axis] - reach, first[axis]) + 1e-9 ? 0 : 1;
      missing += hi >= std::min(block.owned.hi[axis] + reach, last[axis]) - 1e-9 ? 0 : 1;
    }
    CHECK(wrong == 0);
    CHECK(missing == 0);
    if (!halo) CHECK(beyond == 0);  // beyond the domain, the outermost values count
  }
}

TEST_CASE("ghost layers beyond the domain, set by a star stencil: many blocks have the values of one") {
  const Communicator world = Communicator::world();
  const auto joint = GENERATE(synthetic::Joint::Cells, synthetic::Joint::SharedPoints, synthetic::Joint::Gap);
  const bool cells = joint == synthetic::Joint::Cells;
  const int layers = GENERATE(1, 2);
  const auto parts = GENERATE(glm::ivec3(2, 1, 1), glm::ivec3(4, 3, 2));
  const synthetic::Lattice lattice{{12, 9, 8}, {1.0, -2.0, 0.0}, {0.5, 1.0, 2.0}, ScalarType::F64, joint};
  const Field wave = [](const glm::dvec3& p) {
    return std::sin(1.3 * p.x) * std::cos(0.4 * p.y) + std::sin(0.3 * p.z + 0.2 * p.x * p.y);
  };
  const auto exchanged = [&](const Communicator& comm, const glm::ivec3& blocks) {
    std::vector<Block> mine;
    const auto value = [&](const glm::ivec3& index) { return wave(placeIn(lattice, index)); };
    for (const Block& block : decomposed(lattice, blocks, synthetic::Layout::Random, comm, value))
      mine.push_back(withStarHalo(block, cells, layers, wave));
    return comm::exchangeGhosts(comm, mine);
  };
  const Block whole = exchanged(Communicator::serial(), glm::ivec3(1)).front();
  const double reach = (cells ? 1.5 : 1.0) + 1e-6;
  INFO("cells " << cells << ", joint " << static_cast<int>(joint) << ", layers " << layers);
  for (const Block& block : exchanged(world, parts)) {
    int wrong = 0;
    const IndexBox around{glm::ivec3(-3), block.dims + 3};
    forEachValue(around, [&](const glm::ivec3& at) {
      const glm::dvec3 place = placeOf(block, at);
      const glm::dvec3 beyond = reach * block.spacing;
      if (glm::any(glm::lessThan(place, block.owned.lo - beyond)) ||
          glm::any(glm::greaterThan(place, block.owned.hi + beyond)))
        return;
      // NaN differs from all.
      if (!(std::abs(valueAtPlace(block, place) - valueAtPlace(whole, place)) < 1e-12)) ++wrong;
    });
    CHECK(wrong == 0);
  }
}

TEST_CASE("edges and corners of ghost layers beyond the domain continue a linear field") {
  const Field linear = [](const glm::dvec3& p) { return 3.0 + p.x - 2.0 * p.y + 5.0 * p.z; };
  const auto joint = GENERATE(synthetic::Joint::Cells, synthetic::Joint::SharedPoints);
  const bool cells = joint == synthetic::Joint::Cells;
  const synthetic::Lattice lattice{{5, 4, 6}, {1.0, -2.0, 0.0}, {0.5, 1.0, 2.0}, ScalarType::F64, joint};
  const Communicator alone = Communicator::serial();
  const auto value = [&](const glm::ivec3& index) { return linear(placeIn(lattice, index)); };
  const Block before = decomposed(lattice, glm::ivec3(1), synthetic::Layout::OnOneRank, alone, value).front();
  const Block block = comm::exchangeGhosts(alone, {withStarHalo(before, cells, 1, linear)}).front();
  REQUIRE(block.extended() == block.stored());
  int wrong = 0;
  forEachValue(block.stored(), [&](const glm::ivec3& at) {
    wrong += std::abs(valueAt(block, at.x, at.y, at.z) - linear(placeOf(block, at))) < 1e-9 ? 0 : 1;
  });
  CHECK(wrong == 0);
}

TEST_CASE("a ghost value beside two blocks is the same for all, on any ranks") {
  const Communicator world = Communicator::world();
  const bool cells = GENERATE(true, false);
  // An L: the place where the fourth block is missing lies beside two blocks, whose layers differ.
  const std::vector<glm::dvec3> corners{{3.0, 0.0, 0.0}, {0.0, 3.0, 0.0}, {0.0, 0.0, 0.0}};
  for (int turn = 0; turn < world.size(); ++turn) {
    std::vector<Block> mine;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      if ((static_cast<int>(i) + turn) % world.size() != world.rank()) continue;
      const glm::ivec3 dims(cells ? 3 : 4);
      const std::vector<double> values(64, 7.0);
      const Block block =
          cells ? Block::fromCells(dims, corners[i], glm::dvec3(1.0), ScalarType::F64, values.data())
                : Block::fromPoints(dims, corners[i], glm::dvec3(1.0), ScalarType::F64, values.data());
      mine.push_back(
          withStarHalo(block, cells, 1, [i](const glm::dvec3&) { return 1.0 + static_cast<double>(i); }));
    }
    const glm::dvec3 place = cells ? glm::dvec3(3.5, 3.5, 1.5) : glm::dvec3(4.0, 4.0, 1.0);
    for (const Block& block : comm::exchangeGhosts(world, mine)) {
      const double beyond = cells ? 1.5 : 1.0;
      if (glm::any(glm::greaterThan(place, block.owned.hi + beyond))) continue;
      // The place lies beside the second block along x, which comes before the first one's y.
      CHECK(valueAtPlace(block, place) == 2.0);
    }
  }
}

TEST_CASE("a missing corner is filled with the nearest own value") {
  const Communicator world = Communicator::world();
  const std::vector<float> values(27, 5.0F);
  const std::vector<float> others(27, 7.0F);
  std::vector<Block> blocks;
  if (world.rank() == 0) {
    blocks.push_back(
        Block::fromCells(glm::ivec3(3), glm::dvec3(0.0), glm::dvec3(1.0), ScalarType::F32, values.data()));
  }
  if (world.rank() == world.size() - 1) {
    blocks.push_back(
        Block::fromCells(glm::ivec3(3), {3.0, 0.0, 0.0}, glm::dvec3(1.0), ScalarType::F32, others.data()));
    blocks.push_back(
        Block::fromCells(glm::ivec3(3), {0.0, 3.0, 0.0}, glm::dvec3(1.0), ScalarType::F32, others.data()));
  }
  const std::vector<Block> after = comm::exchangeGhosts(world, blocks);
  if (world.rank() != 0) return;
  const Block& block = after.front();
  REQUIRE(block.extended() == IndexBox{glm::ivec3(0), {5, 5, 3}});
  CHECK(valueAt(block, 3, 1, 1) == 7.0);
  CHECK(valueAt(block, 4, 1, 1) == 7.0);  // rays reach slabReach beyond: two layers of cells
  CHECK(valueAt(block, 1, 3, 1) == 7.0);
  CHECK(valueAt(block, 3, 3, 1) == 5.0);
  CHECK(block.owned.hi == glm::dvec3(3.0));
}
