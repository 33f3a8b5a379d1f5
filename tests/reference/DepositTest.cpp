// Deposits of particles, compared with values that are known without the code under test.
#include <cmath>
#include <limits>
#include <numbers>

#include "tests/Catch.h"
#include "tests/ParticleScenes.h"
#include "vdi/reference/Deposit.h"

using namespace vdi;
using test::cellsIn;
using test::ParticleSet;
using test::randomParticles;

namespace {

const Box cube{glm::dvec3(0.0), glm::dvec3(1.0)};

double at(const reference::Deposit& deposit, std::span<const Block> blocks, std::size_t block, int x, int y,
          int z) {
  return deposit.values[block][blocks[block].stored().position({x, y, z})];
}

double totalOf(std::span<const Block> blocks, const ParticleSet& set, DepositKind kind) {
  return reference::totalOf(blocks, reference::deposit(blocks, set.particles(), kind).values, kind);
}

}  // namespace

TEST_CASE("cloud in cell gives linear weights to eight cells") {
  const std::vector<Block> blocks{cellsIn(cube, glm::dvec3(0.1, 0.2, 0.25))};
  // In cells from the lower corner: (4.75, 2.5, 1.9), so the shares of the upper cells are 0.25, 0 and 0.4.
  ParticleSet set{{{0.475, 0.5, 0.475}}, {3.0}, {}};
  const reference::Deposit sum = reference::deposit(blocks, set.particles(), DepositKind::Sum);
  CHECK(at(sum, blocks, 0, 4, 2, 1) == Approx(3.0 * 0.75 * 0.6));
  CHECK(at(sum, blocks, 0, 5, 2, 1) == Approx(3.0 * 0.25 * 0.6));
  CHECK(at(sum, blocks, 0, 4, 2, 2) == Approx(3.0 * 0.75 * 0.4));
  CHECK(at(sum, blocks, 0, 5, 2, 2) == Approx(3.0 * 0.25 * 0.4));
  CHECK(at(sum, blocks, 0, 4, 1, 1) == Approx(0.0).margin(1e-12));
  CHECK(at(sum, blocks, 0, 3, 2, 1) == 0.0);
  const reference::Deposit density = reference::deposit(blocks, set.particles(), DepositKind::Density);
  CHECK(at(density, blocks, 0, 5, 2, 2) == Approx(3.0 * 0.25 * 0.4 / (0.1 * 0.2 * 0.25)));
}

TEST_CASE("a particle without a weight counts once") {
  const std::vector<Block> blocks{cellsIn(cube, glm::dvec3(0.1))};
  ParticleSet set{{{0.3, 0.3, 0.3}, {0.7, 0.31, 0.62}}, {}, {}};
  CHECK(totalOf(blocks, set, DepositKind::Sum) == Approx(2.0));
}

TEST_CASE("the kernel is the cubic spline where cells resolve it") {
  const double spacing = 0.02;
  const std::vector<Block> blocks{cellsIn(cube, glm::dvec3(spacing))};
  const double h = 0.12;
  ParticleSet set{{{0.503, 0.498, 0.511}}, {2.0}, {h}};
  const reference::Deposit deposit = reference::deposit(blocks, set.particles(), DepositKind::Density);
  const double peak = 2.0 / (std::numbers::pi * h * h * h);
  // From Monaghan's formula by hand: q = 0 has 1, q = 1 has 1/4, q = 3/2 has 1/32, q = 2 has 0.
  const auto seenAt = [&](double distance) {
    double best = 1.0;
    double value = 0.0;
    for (int x = 0; x < 50; ++x) {
      for (int y = 0; y < 50; ++y) {
        for (int z = 0; z < 50; ++z) {
          const double r = glm::length((glm::dvec3(x, y, z) + 0.5) * spacing - set.positions[0]);
          if (std::abs(r - distance) >= best) continue;
          best = std::abs(r - distance);
          value = at(deposit, blocks, 0, x, y, z);
        }
      }
    }
    return value / peak;
  };
  CHECK(seenAt(0.0) == Approx(1.0).epsilon(0.03));
  CHECK(seenAt(h) == Approx(0.25).epsilon(0.02));
  CHECK(seenAt(1.5 * h) == Approx(1.0 / 32.0).epsilon(0.03));
  CHECK(seenAt(2.05 * h) == 0.0);
}

TEST_CASE("no weight is lost: faces, levels, hidden cells, short and long kernels") {
  const std::vector<std::vector<Block>> scenes{
      {cellsIn(cube, glm::dvec3(0.1, 0.05, 0.2))},
      test::latticeIn(cube, 6, {2, 3, 1}, 1),
      test::levelsInCube(),
      test::levelsInCube(2),
  };
  for (const std::vector<Block>& blocks : scenes) {
    // Longest kernel: 0 (cloud in cell), far below a cell, some cells, larger than all blocks.
    for (const double longest : {0.0, 1e-5, 0.09, 0.4, 50.0}) {
      ParticleSet set = randomParticles(longest > 1.0 ? 3 : 40, cube, longest, 7);
      set.positions.push_back({0.0, 0.0, 0.0});  // the domain's lowest corner
      set.positions.push_back({0.999999, 0.999999, 1e-9});
      for (int i = 0; i < 2; ++i) {
        set.weights.push_back(0.7);
        if (longest > 0.0) set.lengths.push_back(longest);
      }
      for (const DepositKind kind : {DepositKind::Sum, DepositKind::Density}) {
        INFO(blocks.size() << " blocks, longest kernel " << longest);
        CHECK(totalOf(blocks, set, kind) == Approx(set.total()).epsilon(1e-12));
      }
    }
  }
}

TEST_CASE("a particle in the domain's corner gives all of its weight to the corner's cell") {
  const std::vector<Block> blocks{cellsIn(cube, glm::dvec3(0.1))};
  ParticleSet set{{{0.0, 0.0, 0.0}}, {5.0}, {}};
  const reference::Deposit deposit = reference::deposit(blocks, set.particles(), DepositKind::Sum);
  CHECK(at(deposit, blocks, 0, 0, 0, 0) == Approx(5.0));
}

TEST_CASE("ghost cells have their owners' values") {
  const std::vector<Block> blocks = test::levelsInCube(2);
  const ParticleSet set = randomParticles(300, cube, 0.0, 3);
  const reference::Deposit deposit = reference::deposit(blocks, set.particles(), DepositKind::Density);
  // The first block's upper ghost layer along x is the second block's first layer of cells.
  double seen = 0.0;
  for (int y = 2; y < 8; ++y) {
    for (int z = 2; z < 8; ++z) {
      CHECK(at(deposit, blocks, 0, 8, y, z) == Approx(at(deposit, blocks, 1, 2, y, z)).margin(1e-12));
      seen += at(deposit, blocks, 1, 2, y, z);
    }
  }
  CHECK(seen > 1.0);
}

TEST_CASE("hidden cells have the mean of what hides them") {
  const std::vector<Block> blocks = test::levelsInCube();
  // Cell (5, 5, 5) of the first block, from 5/12 to 6/12, lies in the finest block's box.
  const ParticleSet set = randomParticles(2000, {glm::dvec3(0.38), glm::dvec3(0.54)}, 0.0, 3);
  const reference::Deposit deposit = reference::deposit(blocks, set.particles(), DepositKind::Density);
  double sum = 0.0;
  for (int z = 0; z < 10; ++z) {
    for (int y = 0; y < 10; ++y) {
      for (int x = 0; x < 10; ++x) {
        const glm::dvec3 lo = 0.36 + 0.02 * glm::dvec3(x, y, z);
        const glm::dvec3 common = glm::max(glm::min(lo + 0.02, 0.5) - glm::max(lo, 5.0 / 12), 0.0);
        sum += at(deposit, blocks, 9, x, y, z) * common.x * common.y * common.z;
      }
    }
  }
  CHECK(at(deposit, blocks, 0, 5, 5, 5) == Approx(sum * 12 * 12 * 12).epsilon(0.03));
}

TEST_CASE("particles that can't be deposited are counted, and the others are as without them") {
  const std::vector<Block> blocks{cellsIn(cube, glm::dvec3(0.1))};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  const ParticleSet good = randomParticles(10, cube, 0.2, 5);
  ParticleSet set = good;
  const auto add = [&set](const glm::dvec3& position, double weight, double h) {
    set.positions.push_back(position);
    set.weights.push_back(weight);
    set.lengths.push_back(h);
  };
  add({nan, 0.5, 0.5}, 1.0, 0.1);
  add({0.5, infinity, 0.5}, 1.0, 0.1);
  add({0.5, 0.5, 0.5}, nan, 0.1);
  add({1.5, 0.5, 0.5}, 1.0, 0.1);
  add({1.0, 0.5, 0.5}, 1.0, 0.1);  // on the upper face, which no block owns
  add({1e300, 0.5, 0.5}, 1.0, 0.1);
  const reference::Deposit with = reference::deposit(blocks, set.particles(), DepositKind::Sum);
  CHECK(with.counts == ParticleCounts{16, 3, 3, 0});
  CHECK(with.values == reference::deposit(blocks, good.particles(), DepositKind::Sum).values);

  for (const double h : {0.0, -1.0, nan, infinity}) {
    ParticleSet one{{{0.33, 0.44, 0.55}}, {2.0}, {h}};
    ParticleSet cloud{one.positions, one.weights, {}};
    const reference::Deposit bad = reference::deposit(blocks, one.particles(), DepositKind::Sum);
    CHECK(bad.counts == ParticleCounts{1, 0, 0, 1});
    CHECK(bad.values == reference::deposit(blocks, cloud.particles(), DepositKind::Sum).values);
  }
}

TEST_CASE("cloud in cell and the kernel spread equally wide where one takes over") {
  const double spacing = 1.0 / 32;
  const std::vector<Block> blocks{cellsIn(cube, glm::dvec3(spacing))};
  const auto variance = [&](double h) {
    double sum = 0.0;
    ParticleSet set = randomParticles(200, {glm::dvec3(0.4), glm::dvec3(0.6)}, 0.0, 9);
    for (std::size_t i = 0; i < set.positions.size(); ++i) {
      ParticleSet one{{set.positions[i]}, {1.0}, {h}};
      const reference::Deposit deposit = reference::deposit(blocks, one.particles(), DepositKind::Sum);
      for (int z = 10; z < 22; ++z) {
        for (int y = 10; y < 22; ++y) {
          for (int x = 10; x < 22; ++x) {
            const double away = (x + 0.5) * spacing - one.positions[0].x;
            sum += at(deposit, blocks, 0, x, y, z) * away * away;
          }
        }
      }
    }
    return sum / (200.0 * spacing * spacing);
  };
  CHECK(variance(0.749 * spacing) == Approx(1.0 / 6.0).epsilon(0.1));
  CHECK(variance(0.751 * spacing) == Approx(1.0 / 6.0).epsilon(0.15));
}
