// Blocks of different levels, lattices and types, side by side and overlapping: a linear field must stay
// linear everywhere, and each place must have one owner.
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <span>

#include "tests/Catch.h"
#include "tests/Thrown.h"
#include "vdi/comm/GhostExchange.h"
#include "vdi/core/Error.h"
#include "vdi/reference/Reference.h"

using namespace vdi;
using comm::Communicator;

namespace {

enum class Kind { Points, Cells };

double linear(const glm::dvec3& p) {
  return 100.0 + 20.0 * p.x - 30.0 * p.y + 50.0 * p.z;
}

using Field = std::function<double(const glm::dvec3&)>;

/// The block with `cells` cells from `lo` to `hi`.
Block blockIn(Kind kind, const Box& box, const glm::ivec3& cells, ScalarType type = ScalarType::F64,
              const Field& field = linear) {
  const glm::dvec3 spacing = box.size() / glm::dvec3(cells);
  const glm::ivec3 dims = kind == Kind::Cells ? cells : cells + 1;
  Block block = kind == Kind::Cells ? Block::fromCells(dims, box.lo, spacing, type, nullptr)
                                    : Block::fromPoints(dims, box.lo, spacing, type, nullptr);
  block.owned = box;
  const std::shared_ptr<std::byte[]> values(new std::byte[block.byteCount()]);
  std::size_t index = 0;
  for (int z = 0; z < dims.z; ++z) {
    for (int y = 0; y < dims.y; ++y) {
      for (int x = 0; x < dims.x; ++x)
        storeValue(type, values.get(), index++, field(block.origin + glm::dvec3(x, y, z) * spacing));
    }
  }
  block.data = values.get();
  block.keepAlive = std::shared_ptr<const void>(values, values.get());
  return block;
}

/// This rank's share of the blocks.
std::vector<Block> decomposed(const std::vector<Block>& all, const Communicator& world) {
  std::vector<Block> mine;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (static_cast<int>((i * 7 + i / 3) % static_cast<std::size_t>(world.size())) == world.rank())
      mine.push_back(all[i]);
  }
  return mine;
}

/// The largest interpolation error in any block of any rank, in its owned box and up to half a spacing
/// beyond, within `where`.
double worstError(const Communicator& world, const std::vector<Block>& blocks, const Box& where,
                  const Field& field = linear) {
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  double worst = 0.0;
  for (const Block& block : blocks) {
    const Box around =
        Box{block.owned.lo - 0.49 * block.spacing, block.owned.hi + 0.49 * block.spacing}.intersection(where);
    if (around.empty()) continue;
    for (int i = 0; i < 500; ++i) {
      const glm::dvec3 place =
          around.lo + glm::dvec3(share(generator), share(generator), share(generator)) * around.size();
      const double error = std::abs(reference::interpolate(block, place) - field(place));
      worst = std::max(worst, std::isfinite(error) ? error : std::numeric_limits<double>::infinity());
    }
  }
  world.allReduceMax(std::span(&worst, 1));
  return worst;
}

/// The number of random places of the domain that do not have exactly one owner.
int placesWithoutOneOwner(const Communicator& world, const std::vector<Block>& blocks, const Box& domain) {
  std::mt19937 generator(7);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  std::vector<double> owners(2000, 0.0);
  for (double& count : owners) {
    const glm::dvec3 place =
        domain.lo + glm::dvec3(share(generator), share(generator), share(generator)) * domain.size();
    for (const Block& block : blocks) {
      const bool owns = glm::all(glm::greaterThanEqual(place, block.owned.lo)) &&
                        glm::all(glm::lessThan(place, block.owned.hi));
      count += owns ? 1.0 : 0.0;
    }
  }
  world.allReduceSum(owners);
  int wrong = 0;
  for (const double count : owners) wrong += count == 1.0 ? 0 : 1;
  return wrong;
}

Box cube(double lo, double hi) {
  return {glm::dvec3(lo), glm::dvec3(hi)};
}

Box shrunk(const Box& box, double by) {
  return {box.lo + by, box.hi - by};
}

/// 3 x 3 x 3 cubes of side 1, with `cells` cells per side in turns.
std::vector<Block> cubes(Kind kind, const std::vector<int>& cells) {
  std::vector<Block> all;
  for (int i = 0; i < 27; ++i) {
    const glm::dvec3 lo(i % 3, i / 3 % 3, i / 9);
    const auto turn = static_cast<std::size_t>(i * 5 + i / 3 + i / 9) % cells.size();
    all.push_back(blockIn(kind, {lo, lo + 1.0}, glm::ivec3(cells[turn])));
  }
  return all;
}

constexpr double rounding = 1e-9;  // for values of some 100

}  // namespace

TEST_CASE("three levels side by side: a linear field has no seams") {
  const Communicator world = Communicator::world();
  const Kind kind = GENERATE(Kind::Points, Kind::Cells);
  const std::vector<Block> after = comm::exchangeGhosts(world, decomposed(cubes(kind, {4, 8, 16}), world));
  // The outermost half of a coarse cell has no neighbours to interpolate with, and a finer cell may read it.
  const Box inner = shrunk(cube(0.0, 3.0), kind == Kind::Cells ? 0.25 : 0.0);
  CHECK(worstError(world, after, inner) < rounding);
  CHECK(placesWithoutOneOwner(world, after, cube(0.0, 3.0)) == 0);
  for (const Block& block : after) CHECK((block.extra.lo + block.extra.hi != glm::ivec3(0)));
}

TEST_CASE("levels with ghost layers beyond the domain, whose edges are unset: a linear field has no seams") {
  const Communicator world = Communicator::world();
  const Kind kind = GENERATE(Kind::Points, Kind::Cells);
  std::vector<Block> all;
  for (const Block& block : cubes(kind, {4, 8, 16})) {
    const auto star = [&block](const glm::dvec3& place) {
      int outside = 0;
      for (int axis = 0; axis < 3; ++axis)
        outside += place[axis] < block.owned.lo[axis] || place[axis] > block.owned.hi[axis] ? 1 : 0;
      return outside > 1 ? std::numeric_limits<double>::quiet_NaN() : linear(place);
    };
    const glm::ivec3 cells(glm::round(block.owned.size() / block.spacing));
    const Box around{block.owned.lo - block.spacing, block.owned.hi + block.spacing};
    all.push_back(blockIn(kind, around, cells + 2, ScalarType::F64, star));
    all.back().owned = block.owned;
  }
  const std::vector<Block> after = comm::exchangeGhosts(world, decomposed(all, world));
  CHECK(worstError(world, after, cube(0.0, 3.0)) < rounding);
}

TEST_CASE("three levels side by side: a curved field is off by what the coarsest level is off") {
  const Communicator world = Communicator::world();
  const auto curved = [](const glm::dvec3& p) {
    return std::sin(1.5 * p.x + 0.5 * p.y) + std::cos(p.z - p.x) * std::sin(p.y);
  };
  for (const Kind kind : {Kind::Points, Kind::Cells}) {
    const auto cubesOf = [&](const std::vector<int>& cells) {
      std::vector<Block> all;
      for (const Block& block : cubes(kind, cells)) {
        const glm::ivec3 side(glm::round(block.owned.size() / block.spacing));
        all.push_back(blockIn(kind, block.owned, side, ScalarType::F64, curved));
      }
      return comm::exchangeGhosts(world, decomposed(all, world));
    };
    const Box inner = shrunk(cube(0.0, 3.0), 0.25);
    const double levels = worstError(world, cubesOf({4, 8, 16}), inner, curved);
    const double coarsest = worstError(world, cubesOf({4}), inner, curved);
    INFO((kind == Kind::Cells ? "cells: " : "points: ") << levels << ", the coarsest " << coarsest);
    CHECK(coarsest > 0.01);
    // A mean of cells differs from the value in their middle by as much as interpolation may err.
    CHECK(levels < (kind == Kind::Cells ? 1.5 : 1.05) * coarsest);
  }
}

TEST_CASE("spacings with a ratio that is no power of two") {
  const Communicator world = Communicator::world();
  const auto cells = GENERATE(std::vector<int>{3, 9, 27}, std::vector<int>{4, 6, 10}, std::vector<int>{5, 7});
  INFO(cells[0] << " to " << cells.back() << " cells");
  const auto points = comm::exchangeGhosts(world, decomposed(cubes(Kind::Points, cells), world));
  CHECK(worstError(world, points, cube(0.0, 3.0)) < rounding);
  const auto means = comm::exchangeGhosts(world, decomposed(cubes(Kind::Cells, cells), world));
  // If cells of two levels do not nest, each side interpolates in the other: not exact to the last bit.
  const bool whole = cells[0] == 3;
  const double step = 100.0 / cells[0];  // the field's step along a coarse cell's diagonal
  CHECK(worstError(world, means, shrunk(cube(0.0, 3.0), 1.0 / cells[0])) < (whole ? rounding : 0.05 * step));
}

TEST_CASE("a finer block owns the place over a coarse one, and covered values don't bleed") {
  const Communicator world = Communicator::world();
  const Kind kind = GENERATE(Kind::Points, Kind::Cells);
  const int ratio = GENERATE(2, 4);
  const bool fill = GENERATE(true, false);
  INFO("ratio " << ratio);
  const Box fine{{0.25, 0.375, 0.25}, {0.75, 0.75, 0.625}};
  const Box finest{{0.375, 0.5, 0.375}, {0.5, 0.625, 0.5}};
  const auto garbage = [&](const Box& covered) {
    return [covered](const glm::dvec3& p) {
      const bool inside =
          glm::all(glm::greaterThan(p, covered.lo - 1e-9)) && glm::all(glm::lessThan(p, covered.hi + 1e-9));
      return inside ? -1e6 : linear(p);
    };
  };
  std::vector<Block> all;
  all.push_back(blockIn(kind, cube(0.0, 1.0), glm::ivec3(16), ScalarType::F64, garbage(fine)));
  const glm::ivec3 cells(glm::round(fine.size() * 16.0 * static_cast<double>(ratio)));
  all.push_back(blockIn(kind, fine, cells, ScalarType::F64, garbage(finest)));
  const glm::ivec3 finestCells(glm::round(finest.size() * 16.0 * static_cast<double>(ratio * ratio)));
  all.push_back(blockIn(kind, finest, finestCells));
  const std::vector<Block> mine = decomposed(all, world);
  if (!fill) {
    const std::vector<Block> after = comm::settleOwnership(world, mine);
    CHECK(placesWithoutOneOwner(world, after, cube(0.0, 1.0)) == 0);
    return;
  }
  const std::vector<Block> after = comm::exchangeGhosts(world, mine);
  CHECK(placesWithoutOneOwner(world, after, cube(0.0, 1.0)) == 0);
  CHECK(worstError(world, after, shrunk(cube(0.0, 1.0), kind == Kind::Cells ? 1.0 / 32 : 0.0)) < 1e-8);
  CHECK(after.size() >= mine.size());
  for (const Block& block : after) CHECK(block.dims == block.stored().hi);
}

TEST_CASE("lattices that fit nearly or not at all: no seam") {
  const Communicator world = Communicator::world();
  const Kind kind = GENERATE(Kind::Points, Kind::Cells);
  // Spacings that differ by 1e-6; the same spacing, shifted by 0.3 of it along the common face.
  std::vector<Block> all;
  all.push_back(blockIn(kind, cube(0.0, 1.0), glm::ivec3(10)));
  all.push_back(
      blockIn(kind, {{1.0, 0.0, 0.0}, {2.0 * (1.0 + 1e-6), 1.0 + 1e-6, 1.0 + 1e-6}}, glm::ivec3(10)));
  all.push_back(blockIn(kind, {{0.0, 1.0 + 1e-6, 0.03}, {2.0, 2.0, 1.03}}, {20, 10, 10}));
  const std::vector<Block> after = comm::exchangeGhosts(world, decomposed(all, world));
  const Box inner{{0.1, 0.1, 0.2}, {1.9, 1.9, 0.8}};
  CHECK(worstError(world, after, inner) < 1e-3);
  CHECK(placesWithoutOneOwner(world, after, inner) == 0);
}

TEST_CASE("blocks of different types get one type that represents all") {
  const Communicator world = Communicator::world();
  const auto [type, common] =
      GENERATE(std::pair(ScalarType::U8, ScalarType::F32), std::pair(ScalarType::I32, ScalarType::F64));
  const auto field = [](const glm::dvec3& p) { return std::round(10.0 * p.x + 20.0 * p.y); };
  std::vector<Block> all;
  all.push_back(blockIn(Kind::Points, cube(0.0, 1.0), glm::ivec3(10), type, field));
  all.push_back(
      blockIn(Kind::Points, {{1.0, 0.0, 0.0}, {2.0, 1.0, 1.0}}, glm::ivec3(10), ScalarType::F32, field));
  const std::vector<Block> after = comm::exchangeGhosts(world, decomposed(all, world));
  for (const Block& block : after) {
    CHECK(block.type == common);
    CHECK(block.extra.lo.x + block.extra.hi.x == 1);
    const int i = block.extra.lo.x > 0 ? -1 : 11;
    const double x = block.origin.x + i * block.spacing.x;
    for (int j = 0; j < 11; ++j) CHECK(valueAt(block, i, j, 5) == field({x, 0.1 * j, 0.5}));
  }
}

TEST_CASE("gaps of points between levels get an owner") {
  const Communicator world = Communicator::world();
  // Cells per side, and the distance from the first block's last point, at 1, to the second block.
  const auto [first, second, gap] =
      GENERATE(std::tuple(8, 4, 0.25), std::tuple(8, 4, 0.125), std::tuple(4, 8, 0.25),
               std::tuple(4, 8, 0.125), std::tuple(8, 8, 0.05));
  INFO(first << " and " << second << " cells, " << gap << " apart");
  std::vector<Block> all;
  all.push_back(blockIn(Kind::Points, cube(0.0, 1.0), glm::ivec3(first)));
  all.push_back(blockIn(Kind::Points, {{1.0 + gap, 0.0, 0.0}, {2.0 + gap, 1.0, 1.0}}, glm::ivec3(second)));
  const std::vector<Block> after = comm::exchangeGhosts(world, decomposed(all, world));
  const Box domain{glm::dvec3(0.0), {2.0 + gap, 1.0, 1.0}};
  CHECK(placesWithoutOneOwner(world, after, domain) == 0);
  CHECK(worstError(world, after, domain) < rounding);
}

TEST_CASE("blocks of points more than a cell apart stay apart") {
  const Communicator world = Communicator::world();
  std::vector<Block> all;
  all.push_back(blockIn(Kind::Points, cube(0.0, 1.0), glm::ivec3(4)));
  all.push_back(blockIn(Kind::Points, {{1.51, 0.0, 0.0}, {2.51, 1.0, 1.0}}, glm::ivec3(4)));
  const std::vector<Block> mine = decomposed(all, world);
  const std::vector<Block> after = comm::exchangeGhosts(world, mine);
  REQUIRE(after.size() == mine.size());
  for (std::size_t i = 0; i < after.size(); ++i) {
    CHECK(after[i].owned == mine[i].owned);
    CHECK(after[i].extended() == after[i].stored());
    CHECK(after[i].patches == nullptr);
  }
}

TEST_CASE("faces that differ by rounding, or by 1e-4 of a voxel, are one; filled or not") {
  const Communicator world = Communicator::world();
  const bool fill = GENERATE(true, false);
  const double off = GENERATE(1e-5, -1e-5, 1e-14);  // in spacings of 0.1
  std::vector<Block> all;
  for (int i = 0; i < 8; ++i) {
    const glm::dvec3 lo(i % 2, i / 2 % 2, i / 4);
    const glm::dvec3 shift = off * glm::dvec3(i % 2 != 0, i / 2 % 2 != 0, i / 4 != 0);
    all.push_back(blockIn(Kind::Cells, {lo + shift, lo + 1.0}, glm::ivec3(10)));
  }
  const auto after = fill ? comm::exchangeGhosts(world, decomposed(all, world))
                          : comm::settleOwnership(world, decomposed(all, world));
  for (const Block& block : after) {
    for (int axis = 0; axis < 3; ++axis) {
      const double face = block.owned.lo[axis] > 0.5 ? block.owned.lo[axis] : block.owned.hi[axis];
      CHECK(face == 1.0 + std::min(off, 0.0));
    }
  }
  CHECK(placesWithoutOneOwner(world, after, cube(0.0, 2.0)) == 0);
}

TEST_CASE("blocks of one level that overlap are refused on all ranks, with both names") {
  const Communicator world = Communicator::world();
  const bool fill = GENERATE(true, false);
  const double depth = GENERATE(0.0003, 0.05, 1.0);  // in spacings of 0.1
  std::vector<Block> mine;
  if (world.rank() == 0) {
    mine.push_back(blockIn(Kind::Cells, cube(5.0, 6.0), glm::ivec3(10)));
    mine.push_back(blockIn(Kind::Cells, cube(0.0, 1.0), glm::ivec3(10)));
  }
  if (world.rank() == world.size() - 1) {
    const glm::dvec3 lo(1.0 - depth, 0.5, 0.5);
    mine.push_back(blockIn(Kind::Cells, {lo, lo + 1.0}, glm::ivec3(10)));
  }
  const auto [code, text] = vdi::test::thrownBy(
      [&] { fill ? comm::exchangeGhosts(world, mine) : comm::settleOwnership(world, mine); });
  CHECK(code == ErrorCode::InvalidArgument);
  CHECK_THAT(text, vdi::test::ContainsSubstring("block 1 of rank 0 (from (0, 0, 0) to (1, 1, 1))"));
  const std::string second =
      world.size() == 1 ? "block 2 of rank 0" : "block 0 of rank " + std::to_string(world.size() - 1);
  CHECK_THAT(text, vdi::test::ContainsSubstring(second));
}

TEST_CASE("a neighbour's values replace the caller's ghost layers, which stay at the domain's edge") {
  const Communicator world = Communicator::world();
  const double own = 7.0;
  // Ghost layers that a simulation never fills, such as the edges of a star stencil.
  const auto whole = [&](const glm::dvec3& p) { return p.x > 1.0 ? own : linear(p); };
  Block left = blockIn(Kind::Cells, {glm::dvec3(0.0), {1.25, 1.0, 1.0}}, {10, 8, 8}, ScalarType::F64, whole);
  left.owned = cube(0.0, 1.0);
  const auto cells = GENERATE(8, 4, 16);
  const bool masked = GENERATE(true, false);
  if (masked)
    left.masked = std::make_shared<std::vector<IndexBox>>(std::vector{IndexBox{{8, 0, 0}, {10, 8, 8}}});
  std::vector<Block> mine;
  if (world.rank() == 0) mine.push_back(left);
  if (world.rank() == world.size() - 1)
    mine.push_back(blockIn(Kind::Cells, {{1.0, 0.0, 0.0}, {2.0, 1.0, 1.0}}, glm::ivec3(cells)));
  const std::vector<Block> after = comm::exchangeGhosts(world, mine);
  if (world.rank() != 0) return;
  const Block& block = after.front();
  CHECK(block.data == left.data);
  CHECK(block.extended().hi.x == block.stored().hi.x);
  CHECK(valueAt(block, 8, 4, 4) == Approx(linear(left.origin + glm::dvec3(8, 4, 4) * left.spacing)));
}

TEST_CASE("the caller's ghost layers at the domain's edge are used unchanged") {
  const Communicator world = Communicator::world();
  const auto field = [](const glm::dvec3& p) { return p.x > 1.0 ? 7.0 : linear(p); };
  Block block = blockIn(Kind::Cells, {glm::dvec3(0.0), {1.25, 1.0, 1.0}}, {10, 8, 8}, ScalarType::F64, field);
  block.owned = cube(0.0, 1.0);
  const std::vector<Block> after =
      comm::exchangeGhosts(world, world.rank() == 0 ? std::vector{block} : std::vector<Block>{});
  if (world.rank() != 0) return;
  CHECK(after.front().extended() == block.stored());
  CHECK(valueAt(after.front(), 8, 4, 4) == 7.0);
}

TEST_CASE("cells of two levels are continued to the domain's faces, without overshooting") {
  const Communicator world = Communicator::world();
  // Along x the field is linear, along y it has an edge beside the outermost cells.
  const auto field = [](const glm::dvec3& p) { return p.x + (p.y > 0.25 ? 10.0 : 0.0); };
  std::vector<Block> mine;
  if (world.rank() == 0)
    mine.push_back(blockIn(Kind::Cells, cube(0.0, 1.0), glm::ivec3(4), ScalarType::F64, field));
  if (world.rank() == world.size() - 1)
    mine.push_back(
        blockIn(Kind::Cells, {{1.0, 0.0, 0.0}, {2.0, 1.0, 1.0}}, glm::ivec3(8), ScalarType::F64, field));
  const std::vector<Block> after = comm::exchangeGhosts(world, mine);
  if (world.rank() != 0) return;
  const Block& block = after.front();
  REQUIRE(block.extended().contains({-1, -1, 2}));
  CHECK(valueAt(block, -1, 2, 2) == Approx(-0.125 + 10.0));
  CHECK(valueAt(block, 2, -1, 2) == Approx(0.625));
  CHECK(valueAt(block, -1, -1, 2) == Approx(-0.125));
}

TEST_CASE("masked values that no other block has become the nearest own ones") {
  const Communicator world = Communicator::world();
  Block block = blockIn(Kind::Cells, cube(0.0, 1.0), glm::ivec3(4), ScalarType::F32,
                        [](const glm::dvec3& p) { return p.x < 0.5 ? 3.0 : -1e9; });
  block.owned.hi.x = 0.5;
  block.masked = std::make_shared<std::vector<IndexBox>>(std::vector{IndexBox{{2, 0, 0}, {4, 4, 4}}});
  const std::vector<Block> after =
      comm::exchangeGhosts(world, world.rank() == 0 ? std::vector{block} : std::vector<Block>{});
  if (world.rank() != 0) return;
  for (int k = 0; k < 4; ++k) CHECK(valueAt(after.front(), 2, 1, k) == 3.0);
}

TEST_CASE("NaN in finer values: the others count, and NaN alone stays NaN") {
  const Communicator world = Communicator::world();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<Block> mine;
  if (world.rank() == 0) mine.push_back(blockIn(Kind::Cells, cube(0.0, 1.0), glm::ivec3(4)));
  if (world.rank() == world.size() - 1) {
    mine.push_back(
        blockIn(Kind::Cells, {{1.0, 0.0, 0.0}, {2.0, 1.0, 1.0}}, glm::ivec3(8), ScalarType::F64,
                [nan](const glm::dvec3& p) { return p.y < 0.25 || (p.x < 1.125 && p.y < 0.5) ? nan : 4.0; }));
  }
  const std::vector<Block> after = comm::exchangeGhosts(world, mine);
  if (world.rank() != 0) return;
  CHECK(std::isnan(valueAt(after.front(), 4, 0, 2)));
  CHECK(valueAt(after.front(), 4, 1, 2) == 4.0);
  CHECK(valueAt(after.front(), 4, 2, 2) == 4.0);
}

TEST_CASE("thousands of blocks of two levels take seconds") {
  const Communicator world = Communicator::world();
  if (world.size() > 3) return;  // the machine may have only two cores
  constexpr int side = 16;
  std::vector<Block> mine;
  for (int i = 0; i < side * side * side; ++i) {
    if (i % world.size() != world.rank()) continue;
    const glm::dvec3 lo(i % side, i / side % side, i / side / side);
    const int cells = lo.x < side / 2 ? 8 : 4;
    mine.push_back(blockIn(Kind::Cells, {lo, lo + 1.0}, glm::ivec3(cells), ScalarType::F32,
                           [](const glm::dvec3& p) { return p.x; }));
  }
  world.barrier();
  const auto start = std::chrono::steady_clock::now();
  const std::vector<Block> after = comm::exchangeGhosts(world, mine);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  WARN("4096 blocks on " << world.size() << " ranks: " << seconds << " s");
  CHECK(seconds < 20.0);
  CHECK(after.size() == mine.size());
  CHECK(worstError(world, after, shrunk(cube(0.0, side), 0.5), [](const glm::dvec3& p) { return p.x; }) <
        1e-4);
}
