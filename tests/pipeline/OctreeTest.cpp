// Leaves of an octree, cells without ghost layers on any number of ranks, compared with the same field as
// points.
#include <cmath>
#include <cstdio>
#include <ctime>
#include <functional>
#include <random>

#include "tests/Catch.h"
#include "tests/Devices.h"
#include "tests/Scenes.h"
#include "tests/pipeline/PictureDifference.h"
#include "vdi/pipeline/VdiGenerator.h"

using namespace vdi;
using test::device;
using test::Difference;
using test::differenceOf;
using test::slanted;

namespace {

using Field = std::function<double(const glm::dvec3&)>;

constexpr int cellsPerLeaf = 8;
const Box unitCube{glm::dvec3(0.0), glm::dvec3(1.0)};

Block withValues(Block block, const Field& field) {
  auto values = std::make_shared<std::vector<float>>();
  for (int z = 0; z < block.dims.z; ++z) {
    for (int y = 0; y < block.dims.y; ++y) {
      for (int x = 0; x < block.dims.x; ++x)
        values->push_back(static_cast<float>(field(block.origin + block.spacing * glm::dvec3(x, y, z))));
    }
  }
  block.data = values->data();
  block.keepAlive = values;
  return block;
}

Block leafOf(bool cells, const Box& box, const Field& field, int cellsPerAxis = cellsPerLeaf) {
  const glm::dvec3 spacing = box.size() / static_cast<double>(cellsPerAxis);
  const glm::ivec3 dims(cellsPerAxis + (cells ? 0 : 1));
  return withValues(cells ? Block::fromCells(dims, box.lo, spacing, ScalarType::F32, nullptr)
                          : Block::fromPoints(dims, box.lo, spacing, ScalarType::F32, nullptr),
                    field);
}

/// Splits the box into ratio^3 parts at the first level, and two parts of five at the next ones.
void addLeaves(std::vector<Box>& leaves, const Box& box, int ratio, int levels, std::mt19937& random) {
  const bool isRoot = box.size().x == 1.0;
  if (levels == 0 || (!isRoot && random() % 5 >= 2)) {
    leaves.push_back(box);
    return;
  }
  const glm::dvec3 size = box.size() / static_cast<double>(ratio);
  for (int i = 0; i < ratio * ratio * ratio; ++i) {
    const glm::dvec3 lo = box.lo + size * glm::dvec3(i % ratio, i / ratio % ratio, i / (ratio * ratio));
    addLeaves(leaves, {lo, lo + size}, ratio, levels - 1, random);
  }
}

/// From transparent to dense within 4 % of [0, 1].
TransferFunction thinRamp() {
  TransferFunction function;
  function.colors = {{0.0, {0.2, 0.4, 0.9}}, {0.5, {0.9, 0.9, 0.3}}, {1.0, {0.9, 0.2, 0.1}}};
  function.opacities = {{0.0, 0.0}, {0.48, 0.0}, {0.52, 0.6}, {1.0, 0.6}};
  function.unitDistance = 0.05;
  return function;
}

/// One octant of the cube has `side`^3 cells, the others one each.
std::vector<Box> cellsOfFineOctant(int side) {
  std::vector<Box> cells;
  const auto add = [&cells](const glm::ivec3& at, double size) {
    cells.push_back({glm::dvec3(at) * size, glm::dvec3(at + 1) * size});
  };
  for (int i = 1; i < 8; ++i) add({i & 1, (i >> 1) & 1, i >> 2}, 0.5);
  for (int i = 0; i < side * side * side; ++i)
    add({i % side, i / side % side, i / (side * side)}, 0.5 / side);
  return cells;
}

double ball(const glm::dvec3& p) {
  return 1.2 - 1.6 * glm::length(p - glm::dvec3(0.5));
}

double wave(const glm::dvec3& p) {
  return 0.5 + 0.3 * std::sin(2.0 * p.x + p.y) * std::cos(1.5 * p.z - p.x);
}

}  // namespace

TEST_CASE("an octree of cells with a thin ramp: the picture of the same octree of points") {
  const comm::Communicator world = comm::Communicator::world();
  struct Scene {
    const char* name;
    Field field;
    double worst;       // in 1/255
    double wrongShare;  // share of pixels off by more than 16
  };
  // Cells and points interpolate a curved field at different places; the linear field isolates seams.
  const Scene scenes[] = {{"linear", slanted, 1.0, 0.0}, {"ball", ball, 16.0, 0.0}, {"wave", wave, 4.0, 0.0}};
  GenerateSettings settings = test::smallSettings(120, 90, 20);
  settings.samplesPerVoxel = 4.0;
  VdiGenerator many(device(), comm::Communicator::world());
  VdiGenerator one(device(), comm::Communicator::serial());
  for (const int ratio : {2, 4}) {
    std::mt19937 random(7);
    std::vector<Box> leaves;
    addLeaves(leaves, unitCube, ratio, ratio == 2 ? 3 : 2, random);
    for (const Scene& scene : scenes) {
      if (ratio == 4 && scene.worst > 1.0) continue;  // a linear field shows seams best
      std::vector<Block> mine;
      std::vector<Block> points;
      for (std::size_t i = 0; i < leaves.size(); ++i) {
        if (static_cast<int>(i % static_cast<std::size_t>(world.size())) == world.rank())
          mine.push_back(leafOf(true, leaves[i], scene.field));
        if (world.rank() == 0) points.push_back(leafOf(false, leaves[i], scene.field));
      }
      many.setBlocks(std::move(mine));
      const auto image = many.renderVolume(test::oblique(), thinRamp(), settings);
      if (!image) continue;
      one.setBlocks(std::move(points));
      const auto truth = one.renderVolume(test::oblique(), thinRamp(), settings);
      const Difference difference = differenceOf(*image, *truth);
      std::printf(
          "%d ranks, %s, %zu leaves of ratio %d: off by %.2f of 255 at most, %.3f %% by more than 16\n",
          world.size(), scene.name, leaves.size(), ratio, difference.worst, 100.0 * difference.wrongShare);
      CHECK(difference.worst < scene.worst);
      CHECK(difference.wrongShare <= scene.wrongShare);
    }
  }
}

TEST_CASE("10 000 blocks of one cell: the picture of few blocks, in time in proportion to their number") {
  const comm::Communicator world = comm::Communicator::world();
  VdiGenerator generator(device(), comm::Communicator::world());
  const auto show = [&](const std::vector<Box>& boxes, const auto& cellsOf) {
    std::vector<Block> mine;
    for (auto i = static_cast<std::size_t>(world.rank()); i < boxes.size();
         i += static_cast<std::size_t>(world.size()))
      mine.push_back(leafOf(true, boxes[i], wave, cellsOf(i)));
    const std::clock_t before = std::clock();
    generator.setBlocks(std::move(mine));
    return static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
  };
  const auto single = [](std::size_t) { return 1; };
  const auto picture = [&] {
    return generator.renderVolume(test::oblique(), thinRamp(), test::smallSettings(120, 90, 20));
  };
  constexpr int side = 22;
  const std::vector<Box> few = cellsOfFineOctant(1);
  show(few, [](std::size_t i) { return i < 7 ? 1 : side; });
  const auto expected = picture();
  const std::vector<Box> some = cellsOfFineOctant(side / 2);
  const double secondsOfSome = show(some, single);
  const std::vector<Box> many = cellsOfFineOctant(side);
  CHECK(many.size() > 10000);
  const double seconds = show(many, single);
  std::printf("%d ranks: %zu blocks in %.3f s, %zu in %.3f s\n", world.size(), some.size(), secondsOfSome,
              many.size(), seconds);
  CHECK(seconds / static_cast<double>(many.size()) < 2.0 * secondsOfSome / static_cast<double>(some.size()));
  const auto image = picture();
  if (!image) return;
  CHECK(differenceOf(*image, *expected).worst < 1.0);
}
