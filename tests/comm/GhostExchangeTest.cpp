// Ghost layers: what lies between blocks that share nothing, wherever the neighbours are.
#include <catch2/catch.hpp>
#include <span>

#include "apps/Decomposition.h"
#include "vdi/comm/GhostExchange.h"

using namespace vdi;
using comm::Communicator;

namespace {

/// A different value at each lattice index, exact in all types used here.
double marker(const glm::ivec3& index) {
  return index.x + 20 * index.y + 400 * index.z;
}

std::vector<Block> dealt(const apps::Lattice& lattice, const glm::ivec3& blocks, apps::Layout layout,
                         const Communicator& world) {
  std::vector<Block> mine;
  for (const apps::Part& part :
       apps::decompose(lattice.size, blocks, layout, lattice.joint, world.size(), 11)) {
    if (part.owner == world.rank()) mine.push_back(apps::makeBlock(lattice, part, marker));
  }
  return mine;
}

glm::ivec3 indexOf(const apps::Lattice& lattice, const glm::dvec3& position) {
  const double half = lattice.joint == apps::Joint::Cells ? 0.5 : 0.0;
  return glm::ivec3(glm::round((position - lattice.origin) / lattice.spacing - half));
}

/// Every stored value, ghosts included, is the one that belongs there.
void checkValues(const apps::Lattice& lattice, const Block& block) {
  int wrong = 0;
  for (int k = 0; k < block.dims.z; ++k) {
    for (int j = 0; j < block.dims.y; ++j) {
      for (int i = 0; i < block.dims.x; ++i) {
        const glm::ivec3 index = indexOf(lattice, block.origin + glm::dvec3(i, j, k) * block.spacing);
        if (valueAt(block, i, j, k) != marker(index)) ++wrong;
      }
    }
  }
  CHECK(wrong == 0);
}

}  // namespace

TEST_CASE("blocks of a whole lattice get their neighbours' values, and all of space has one owner") {
  const Communicator world = Communicator::world();
  const auto joint = GENERATE(apps::Joint::Gap, apps::Joint::Cells, apps::Joint::SharedPoints);
  const auto layout = GENERATE(apps::Layout::Interleaved, apps::Layout::Random, apps::Layout::OnOneRank);
  const auto type = GENERATE(ScalarType::U16, ScalarType::F32, ScalarType::F64);
  const apps::Lattice lattice{{13, 9, 11}, {-3.0, 1e3, 0.1}, {0.1, 2.0, 1.0 / 3.0}, type, joint};
  const std::vector<Block> before = dealt(lattice, {3, 2, 4}, layout, world);
  const std::vector<Block> after = comm::exchangeGhosts(world, before);
  REQUIRE(after.size() == before.size());
  double volume = 0.0;  // owned here, then by all
  for (std::size_t i = 0; i < after.size(); ++i) {
    checkValues(lattice, after[i]);
    const glm::dvec3 size = after[i].owned.size();
    volume += size.x * size.y * size.z;
    if (joint == apps::Joint::SharedPoints) CHECK(after[i].data == before[i].data);
  }
  const glm::dvec3 extent =
      glm::dvec3(lattice.size - (joint == apps::Joint::Cells ? 0 : 1)) * lattice.spacing;
  world.allReduceSum(std::span(&volume, 1));
  CHECK(volume == Approx(extent.x * extent.y * extent.z));
}

TEST_CASE("lattices that don't meet leave each other alone") {
  const Communicator world = Communicator::world();
  const std::vector<float> values(27, 1.0F);
  const double apart =
      GENERATE(2.5, 4.0, 2.2);  // shifted by half a cell; two cells between; a fifth of a cell
  std::vector<Block> blocks;
  for (int i = 0; i < 2; ++i) {
    if (i % world.size() != world.rank()) continue;
    blocks.push_back(Block::fromPoints(glm::ivec3(3), {i * apart, 0.0, 0.0}, glm::dvec3(1.0), ScalarType::F32,
                                       values.data()));
  }
  for (const Block& block : comm::exchangeGhosts(world, blocks)) CHECK(block.data == values.data());
}

TEST_CASE("other spacing or another type is no neighbour") {
  const Communicator world = Communicator::world();
  const std::vector<double> values(27, 1.0);
  std::vector<Block> blocks;
  if (world.rank() == 0) {
    blocks.push_back(
        Block::fromPoints(glm::ivec3(3), glm::dvec3(0.0), glm::dvec3(1.0), ScalarType::F32, values.data()));
  }
  if (world.rank() == world.size() - 1) {
    blocks.push_back(
        Block::fromPoints(glm::ivec3(3), {3.0, 0.0, 0.0}, glm::dvec3(2.0), ScalarType::F32, values.data()));
    blocks.push_back(
        Block::fromPoints(glm::ivec3(3), {0.0, 3.0, 0.0}, glm::dvec3(1.0), ScalarType::F64, values.data()));
  }
  for (const Block& block : comm::exchangeGhosts(world, blocks)) CHECK(block.data == values.data());
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
  REQUIRE(block.dims == glm::ivec3(4, 4, 3));
  CHECK(valueAt(block, 3, 1, 1) == 7.0);
  CHECK(valueAt(block, 1, 3, 1) == 7.0);
  CHECK(valueAt(block, 3, 3, 1) == 5.0);
  CHECK(block.owned.hi == glm::dvec3(3.0));
}
