// Deposits of particles by the device, on any number of ranks, against the reference on one.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <numeric>

#include "tests/Catch.h"
#include "tests/Devices.h"
#include "tests/ParticleScenes.h"
#include "vdi/core/Error.h"
#include "vdi/pipeline/ParticleDepositor.h"
#include "vdi/reference/Deposit.h"

using namespace vdi;
using test::cellsIn;
using test::device;
using test::ParticleSet;
using test::randomParticles;

namespace {

const Box cube{glm::dvec3(0.0), glm::dvec3(1.0)};

/// All ranks' blocks and particles, and this rank's, which are assigned at random.
struct Shared {
  Shared(std::vector<Block> allBlocks, ParticleSet allParticles, const comm::Communicator& comm,
         std::uint32_t seed)
      : blocks(std::move(allBlocks)), set(std::move(allParticles)) {
    std::mt19937 random(seed);
    const auto ranks = static_cast<std::uint32_t>(comm.size());
    const auto isMine = [&] { return random() % ranks == static_cast<std::uint32_t>(comm.rank()); };
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      if (isMine()) mine.push_back(i);
    }
    for (std::size_t i = 0; i < set.positions.size(); ++i) {
      if (isMine()) mySet.add(set, i);
    }
  }
  std::vector<Block> myBlocks() const {
    std::vector<Block> some;
    for (const std::size_t i : mine) some.push_back(blocks[i]);
    return some;
  }

  std::vector<Block> blocks;
  ParticleSet set;
  std::vector<std::size_t> mine;  // indices of blocks
  ParticleSet mySet;
};

DepositedArray depositOn(const comm::Communicator& comm, const std::vector<Block>& blocks,
                         const ParticleSet& set, DepositKind kind) {
  ParticleDepositor depositor(device(), comm);
  depositor.setBlocks(blocks);
  return depositor.deposit(set.particles(), kind);
}

double largestOf(const std::vector<std::vector<double>>& values) {
  double largest = 0.0;
  for (const std::vector<double>& block : values) {
    for (const double value : block) largest = std::max(largest, std::abs(value));
  }
  return largest;
}

/// The largest difference from the reference, as a share of the value or of a thousandth of the largest one.
double differenceOf(const float* values, const std::vector<double>& expected, double largest) {
  double worst = 0.0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const double difference = std::abs(static_cast<double>(values[i]) - expected[i]);
    worst = std::max(worst, difference / std::max(std::abs(expected[i]), 1e-3 * largest));
  }
  return worst;
}

struct Scene {
  const char* name;
  std::vector<Block> blocks;
};

std::vector<Scene> scenes() {
  return {
      {"a block", {cellsIn(cube, glm::dvec3(0.1, 0.05, 0.2))}},
      {"bricks", test::latticeIn(cube, 6, {4, 3, 2})},
      {"bricks with ghost layers", test::latticeIn(cube, 6, {3, 2, 3}, 1)},
      {"levels", test::levelsInCube()},
      {"levels with ghost layers", test::levelsInCube(2)},
  };
}

}  // namespace

TEST_CASE("particles and blocks dealt to ranks at random make the reference's deposit") {
  const comm::Communicator world = comm::Communicator::world();
  double worst = 0.0;
  for (const Scene& scene : scenes()) {
    for (const double longest : {0.0, 1e-5, 0.12, 0.5, 40.0}) {
      for (const DepositKind kind : {DepositKind::Sum, DepositKind::Density}) {
        INFO(scene.name << ", longest kernel " << longest);
        // Some lie outside. The reference takes long for long kernels.
        const std::size_t count = longest > 1.0 ? 6 : longest > 0.3 ? 40 : 300;
        ParticleSet all = randomParticles(count, {glm::dvec3(-0.05), glm::dvec3(1.05)}, longest, 11);
        all.positions[0] = glm::dvec3(0.0);
        if (kind == DepositKind::Sum) all.weights[1] = -0.4;
        const Shared shared(scene.blocks, std::move(all), world, 5);
        const reference::Deposit expected = reference::deposit(shared.blocks, shared.set.particles(), kind);
        const DepositedArray made = depositOn(world, shared.myBlocks(), shared.mySet, kind);
        CHECK(made.counts == expected.counts);
        CHECK(made.counts.outside > 0);
        REQUIRE(made.values.size() == shared.mine.size());
        const double largest = largestOf(expected.values);
        REQUIRE(largest > 0.0);
        for (std::size_t i = 0; i < shared.mine.size(); ++i) {
          const double difference =
              differenceOf(made.values[i].get(), expected.values[shared.mine[i]], largest);
          worst = std::max(worst, difference);
          CHECK(difference < 1e-4);
        }
      }
    }
  }
  if (world.rank() == 0) std::printf("%d ranks: %.1e from the reference at most\n", world.size(), worst);
  CHECK(device()->validationMessages() == "");
}

TEST_CASE("periodic axes wrap positions and weight, on ranks as in the reference") {
  const comm::Communicator world = comm::Communicator::world();
  for (const Scene& scene : scenes()) {
    for (const double longest : {0.0, 0.12, 0.6}) {
      INFO(scene.name << ", longest kernel " << longest);
      ParticleSet all =
          randomParticles(longest > 0.3 ? 20 : 150, {glm::dvec3(-0.7), glm::dvec3(1.6)}, longest, 3);
      all.periodic = {true, true, true};
      all.positions[0] = glm::dvec3(0.0);
      all.positions[1] = glm::dvec3(1.0, -1e-17, 0.5);
      Shared shared(scene.blocks, all, world, 7);
      shared.mySet.periodic = all.periodic;
      const reference::Deposit expected =
          reference::deposit(scene.blocks, all.particles(), DepositKind::Density);
      const DepositedArray made = depositOn(world, shared.myBlocks(), shared.mySet, DepositKind::Density);
      CHECK(made.counts.outside == 0);
      CHECK(reference::totalOf(scene.blocks, expected.values, DepositKind::Density) ==
            Approx(all.total()).epsilon(1e-6));
      for (std::size_t i = 0; i < shared.mine.size(); ++i) {
        CHECK(differenceOf(made.values[i].get(), expected.values[shared.mine[i]],
                           largestOf(expected.values)) < 1e-3);
      }
    }
  }
  // What particles make is the same wherever in the period they are.
  const std::vector<Block> block{cellsIn(cube, glm::dvec3(0.1, 0.05, 0.2))};
  for (const double longest : {0.0, 0.4}) {
    ParticleSet set = randomParticles(40, cube, longest, 4);
    set.periodic = {true, false, false};
    const reference::Deposit before = reference::deposit(block, set.particles(), DepositKind::Sum);
    for (glm::dvec3& position : set.positions) position.x += 0.3 - 2.0;
    const reference::Deposit after = reference::deposit(block, set.particles(), DepositKind::Sum);
    double worst = 0.0;
    for (std::size_t i = 0; i < before.values[0].size(); ++i) {
      const std::size_t moved = i - i % 10 + (i % 10 + 3) % 10;
      worst = std::max(worst, std::abs(before.values[0][i] - after.values[0][moved]));
    }
    CHECK(worst < 1e-9);
  }
}

TEST_CASE("no weight is lost between ranks") {
  const comm::Communicator world = comm::Communicator::world();
  for (const Scene& scene : scenes()) {
    for (const double longest : {0.0, 0.12}) {
      INFO(scene.name << ", longest kernel " << longest);
      const Shared shared(scene.blocks, randomParticles(5000, cube, longest, 2), world, 8);
      const DepositedArray made = depositOn(world, shared.myBlocks(), shared.mySet, DepositKind::Density);
      std::vector<std::vector<double>> values(shared.blocks.size());
      std::vector<double> flat;
      for (std::size_t i = 0; i < shared.blocks.size(); ++i)
        values[i].assign(shared.blocks[i].valueCount(), 0.0);
      for (std::size_t i = 0; i < shared.mine.size(); ++i) {
        std::vector<double>& to = values[shared.mine[i]];
        std::copy_n(made.values[i].get(), to.size(), to.begin());
      }
      std::array<double, 1> total{reference::totalOf(shared.blocks, values, DepositKind::Density)};
      world.allReduceSum(total);
      CHECK(total[0] == Approx(shared.set.total()).epsilon(1e-5));
    }
  }
}

TEST_CASE("a deposit is the same bit by bit when it is repeated and when particles are in another order") {
  const comm::Communicator world = comm::Communicator::world();
  const Shared shared(test::latticeIn(cube, 8, {3, 2, 2}), randomParticles(20000, cube, 0.3, 4), world, 3);
  ParticleDepositor depositor(device(), world);
  depositor.setBlocks(shared.myBlocks());
  const DepositedArray first = depositor.deposit(shared.mySet.particles(), DepositKind::Density);
  ParticleSet turned;
  for (std::size_t i = shared.mySet.positions.size(); i-- > 0;) turned.add(shared.mySet, i);
  const DepositedArray second = depositor.deposit(turned.particles(), DepositKind::Density);
  for (std::size_t i = 0; i < shared.mine.size(); ++i) {
    CHECK(std::memcmp(first.values[i].get(), second.values[i].get(),
                      shared.blocks[shared.mine[i]].valueCount() * sizeof(float)) == 0);
  }
}

TEST_CASE("particles in f32, in columns of their own, and with one weight for all") {
  const comm::Communicator world = comm::Communicator::world();
  const Shared shared({cellsIn(cube, glm::dvec3(0.125))}, randomParticles(500, cube, 0.0, 6), world, 1);
  std::array<std::vector<float>, 3> columns;
  ParticleSet rounded;
  for (const glm::dvec3& p : shared.mySet.positions) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      columns[axis].push_back(static_cast<float>(p[static_cast<int>(axis)]));
    rounded.positions.emplace_back(glm::vec3(p));
    rounded.weights.push_back(0.25);
    rounded.lengths.push_back(0.2);
  }
  const float weight = 0.25F;
  const double h = 0.2;
  Particles particles;
  particles.count = rounded.positions.size();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // Backwards: a stride may be negative.
    const float* last = columns[axis].empty() ? nullptr : &columns[axis].back();
    particles.positions[axis] = {reinterpret_cast<const std::byte*>(last), -4, false};
  }
  particles.weights = {reinterpret_cast<const std::byte*>(&weight), 0, false};
  particles.lengths = {reinterpret_cast<const std::byte*>(&h), 0, true};
  ParticleDepositor depositor(device(), world);
  depositor.setBlocks(shared.myBlocks());
  const DepositedArray made = depositor.deposit(particles, DepositKind::Sum);
  const DepositedArray expected = depositor.deposit(rounded.particles(), DepositKind::Sum);
  CHECK(made.counts == expected.counts);
  for (std::size_t i = 0; i < shared.mine.size(); ++i)
    CHECK(std::memcmp(made.values[i].get(), expected.values[i].get(), 8 * 8 * 8 * sizeof(float)) == 0);
}

TEST_CASE("faults of particles are counted over all ranks, and no particles are no fault") {
  const comm::Communicator world = comm::Communicator::world();
  const auto ranks = static_cast<std::uint64_t>(world.size());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Block> blocks =
      world.rank() == 0 ? std::vector<Block>{cellsIn(cube, glm::dvec3(0.1))} : std::vector<Block>{};
  ParticleSet set;
  const auto add = [&set](const glm::dvec3& position, double weight, double h) {
    set.positions.push_back(position);
    set.weights.push_back(weight);
    set.lengths.push_back(h);
  };
  add({0.5, 0.5, nan}, 1.0, 0.1);
  add({0.5, 0.5, 0.5}, nan, 0.1);
  add({0.5, 0.5, 7.0}, 1.0, 0.1);
  add({0.5, 0.5, 0.5}, 1.0, 0.0);
  add({0.5, 0.5, 0.5}, 1.0, -3.0);
  add({0.5, 0.5, 0.5}, 1.0, nan);
  ParticleDepositor depositor(device(), world);
  depositor.setBlocks(blocks);
  const DepositedArray made = depositor.deposit(set.particles(), DepositKind::Sum);
  CHECK(made.counts == ParticleCounts{6 * ranks, 2 * ranks, ranks, 3 * ranks});
  double total = 0.0;
  if (world.rank() == 0) total = std::accumulate(made.values[0].get(), made.values[0].get() + 1000, 0.0);
  if (world.rank() == 0) CHECK(total == Approx(3.0 * static_cast<double>(ranks)));

  const DepositedArray none = depositor.deposit({}, DepositKind::Sum);
  CHECK(none.counts == ParticleCounts{});
  if (world.rank() == 0) {
    CHECK(std::all_of(none.values[0].get(), none.values[0].get() + 1000, [](float v) { return v == 0.0F; }));
  }
  // No rank has a block.
  depositor.setBlocks({});
  CHECK(depositor.deposit(set.particles(), DepositKind::Sum).counts.outside == 4 * ranks);
}

TEST_CASE("a kernel over more cells than an invocation goes through at once") {
  const comm::Communicator world = comm::Communicator::world();
  ParticleSet all{{{0.31, 0.52, 0.43}, {0.9, 0.1, 0.5}}, {1.0, 2.5}, {1.7, 0.8}};
  const Shared shared({cellsIn(cube, glm::dvec3(1.0 / 110))}, std::move(all), world, 4);
  const reference::Deposit expected =
      reference::deposit(shared.blocks, shared.set.particles(), DepositKind::Density);
  const DepositedArray made = depositOn(world, shared.myBlocks(), shared.mySet, DepositKind::Density);
  for (std::size_t i = 0; i < shared.mine.size(); ++i) {
    CHECK(differenceOf(made.values[i].get(), expected.values[0], largestOf(expected.values)) < 1e-4);
  }
}

TEST_CASE("weights of any magnitude, but values beyond those of f32 are an error on all ranks") {
  const comm::Communicator world = comm::Communicator::world();
  const std::vector<Block> blocks =
      world.rank() == 0 ? std::vector<Block>{cellsIn(cube, glm::dvec3(0.5))} : std::vector<Block>{};
  ParticleDepositor depositor(device(), world);
  depositor.setBlocks(blocks);
  for (const double weight : {1e-290, 1e-30, 1e30, 1e43, 1e300}) {
    ParticleSet set{{{0.25, 0.25, 0.25}}, {weight}, {}};
    if (weight > 1e40) {
      try {
        (void)depositor.deposit(set.particles(), DepositKind::Sum);
        FAIL_CHECK("no error");
      } catch (const Error& error) {
        CHECK(error.code() == (world.rank() == 0 ? ErrorCode::InvalidArgument : ErrorCode::RemoteRank));
      }
      continue;
    }
    const DepositedArray made = depositor.deposit(set.particles(), DepositKind::Sum);
    const double expected = weight * world.size();
    if (world.rank() == 0) CHECK(static_cast<double>(made.values[0][0]) == Approx(expected).margin(1e-40));
  }
  // 2^30 would overflow sums of 32 bits, had they been used.
  ParticleSet many{std::vector<glm::dvec3>(3000, {0.25, 0.25, 0.25}), std::vector<double>(3000, 1e6), {}};
  many.weights[0] = 1e-3;
  const DepositedArray made = depositor.deposit(many.particles(), DepositKind::Sum);
  if (world.rank() == 0)
    CHECK(static_cast<double>(made.values[0][0]) == Approx(2999e6 * world.size()).epsilon(1e-6));
}

TEST_CASE("blocks of one spacing that overlap are an error on all ranks") {
  const comm::Communicator world = comm::Communicator::world();
  ParticleDepositor depositor(device(), world);
  std::vector<Block> blocks;
  if (world.rank() == 0) blocks.push_back(cellsIn(cube, glm::dvec3(0.1)));
  if (world.rank() == world.size() - 1)
    blocks.push_back(cellsIn({glm::dvec3(0.5), glm::dvec3(1.5)}, glm::dvec3(0.1)));
  CHECK_THROWS_WITH(depositor.setBlocks(blocks), test::ContainsSubstring("overlap"));
}

TEST_CASE("millions of particles in one cell, and particles per second", "[long]") {
  const comm::Communicator world = comm::Communicator::world();
  constexpr std::size_t count = 2'000'000;
  const Box cell{glm::dvec3(0.50), glm::dvec3(0.51)};  // in a corner where eight blocks meet
  const auto share = count / static_cast<std::size_t>(world.size());
  const auto seed = static_cast<std::uint32_t>(world.rank() + 1);
  const ParticleSet crowded = randomParticles(share, cell, 0.0, seed);
  const ParticleSet spread = randomParticles(share / 4, cube, 0.0, seed);
  ParticleSet kernels = randomParticles(share / 200, cube, 1.0, seed);
  kernels.lengths.assign(kernels.positions.size(), 0.03);
  const std::vector<Block> blocks = test::latticeIn(cube, 50, {2, 2, 2});
  std::vector<Block> mine;
  for (std::size_t i = static_cast<std::size_t>(world.rank()); i < blocks.size();
       i += static_cast<std::size_t>(world.size()))
    mine.push_back(blocks[i]);
  ParticleDepositor depositor(device(), world);
  depositor.setBlocks(mine);
  const auto seconds = [](auto work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  struct Case {
    const char* name;
    const ParticleSet& set;
    std::size_t ofReference;
  };
  for (const auto& [name, set, few] :
       {Case{"in one cell", crowded, 20000}, Case{"cloud in cell", spread, 20000},
        Case{"kernel of 6 cells in y", kernels, 200}}) {
    DepositedArray made;
    const double onDevice = seconds([&] { made = depositor.deposit(set.particles(), DepositKind::Sum); });
    std::array<double, 2> totals{0.0, set.total()};
    for (std::size_t i = 0; i < mine.size(); ++i)
      totals[0] =
          std::accumulate(made.values[i].get(), made.values[i].get() + mine[i].valueCount(), totals[0]);
    world.allReduceSum(totals);
    CHECK(totals[0] == Approx(totals[1]).epsilon(1e-5));
    if (world.size() > 1) continue;
    ParticleSet some;
    for (std::size_t i = 0; i < few; ++i) some.add(set, i);
    const double onHost =
        seconds([&] { (void)reference::deposit(blocks, some.particles(), DepositKind::Sum); });
    const double perSecond = static_cast<double>(set.positions.size()) / onDevice;
    const double ofReference = static_cast<double>(few) / onHost;
    std::printf("%s: %.3g particles per second, the reference %.3g, ratio %.3g\n", name, perSecond,
                ofReference, perSecond / ofReference);
  }
}
