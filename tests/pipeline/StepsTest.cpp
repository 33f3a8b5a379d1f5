// Time steps: the next step's blocks travel to the device while the current one is shown.
#include <array>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "tests/Catch.h"
#include "tests/Devices.h"
#include "tests/Scenes.h"
#include "vdi/core/Error.h"
#include "vdi/pipeline/VdiGenerator.h"

using namespace vdi;
using synthetic::Joint;
using test::device;

namespace {

struct TimeStep {
  std::vector<Block> blocks;
  ScalarType type = ScalarType::F32;
};

TimeStep timeStep(const char* field, const glm::ivec3& size, ScalarType type) {
  return {
      test::onOneRank(field, size, {2, 1, 2}, type).mine,
      type,
  };
}

TransferFunction functionFor(const TimeStep& step) {
  return test::threeHues(test::topOf(step.type) * 0.8);
}

std::optional<Vdi> frame(VdiGenerator& generator, const TimeStep& step) {
  return generator.generate(test::oblique(), functionFor(step), test::smallSettings(47, 35, 8));
}

/// The VDI of a generator that has only this step.
std::optional<Vdi> frameAlone(VdiGenerator& generator, const TimeStep& step) {
  generator.setBlocks(step.blocks);
  return frame(generator, step);
}

bool equal(const Vdi& a, const Vdi& b) {
  const auto& x = std::get<CompactLists>(a.lists);
  const auto& y = std::get<CompactLists>(b.lists);
  return x.offsets == y.offsets && x.segments.size() == y.segments.size() &&
         std::memcmp(x.segments.data(), y.segments.data(), x.segments.size() * sizeof(x.segments[0])) == 0;
}

Block withoutData() {
  return Block::fromPoints({4, 4, 4}, {}, glm::dvec3(0.1), ScalarType::F32, nullptr);
}

}  // namespace

TEST_CASE("the next step's blocks don't change what's shown until advance, and then they're all that is",
          "[threads]") {
  const std::array steps{
      timeStep("turbulence", {26, 22, 24}, ScalarType::F32),
      timeStep("shells", {26, 22, 24}, ScalarType::F32),
      timeStep("coil", {26, 22, 24}, ScalarType::F32),  // shapes that occurred before
      timeStep("shells", {18, 31, 20}, ScalarType::U8),
      timeStep("turbulence", {18, 31, 20}, ScalarType::F64),
      timeStep("coil", {18, 31, 20}, ScalarType::U16),  // new shapes, some of which need conversion
  };
  VdiGenerator generator(device(), comm::Communicator::serial());
  VdiGenerator alone(device(), comm::Communicator::serial());
  generator.setBlocks(steps[0].blocks);
  std::optional<Vdi> expected = frameAlone(alone, steps[0]);
  for (std::size_t i = 0; i + 1 < steps.size(); ++i) {
    INFO(i);
    const Scene shown = generator.scene();
    const ScalarRange range = generator.scalarRange();
    generator.setNextBlocks(steps[i + 1].blocks);
    CHECK(generator.scene().bounds == shown.bounds);
    CHECK(generator.scalarRange() == range);
    CHECK(equal(*frame(generator, steps[i]), *expected));
    generator.advance();
    expected = frameAlone(alone, steps[i + 1]);
    CHECK(equal(*frame(generator, steps[i + 1]), *expected));
  }
  CHECK(device()->validationMessages() == "");
}

TEST_CASE(
    "a step's report is that of the blocks that are shown; a second volume is held while two are known") {
  const TimeStep small = timeStep("shells", {12, 12, 12}, ScalarType::F32);
  const TimeStep large = timeStep("shells", {64, 64, 64}, ScalarType::F32);
  const auto bytesOf = [](const TimeStep& step) {
    std::uint64_t bytes = 0;
    for (const Block& block : step.blocks) bytes += block.byteCount();
    return bytes;
  };
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks(small.blocks);
  const std::uint64_t before = device()->allocatedBytes();
  generator.setNextBlocks(large.blocks);
  CHECK(device()->allocatedBytes() >= before + bytesOf(large));
  frame(generator, small);
  CHECK(generator.reports().at(0).volumeBytes == bytesOf(small));
  generator.advance();
  frame(generator, large);
  CHECK(generator.reports().at(0).volumeBytes == bytesOf(large));
  CHECK(generator.reports().at(0).blocks == large.blocks.size());
  const std::uint64_t both = device()->allocatedBytes();
  generator.setBlocks(small.blocks);
  CHECK(device()->allocatedBytes() < both - bytesOf(large) / 2);
}

TEST_CASE("the range of the shown step is that of its finite values") {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  constexpr float infinite = std::numeric_limits<float>::infinity();
  constexpr float largest = std::numeric_limits<float>::max();
  VdiGenerator generator(device(), comm::Communicator::serial());
  const auto rangeOf = [&](const std::vector<std::array<float, 8>>& blocks) {
    std::vector<Block> cubes;
    for (const auto& values : blocks) {
      const glm::dvec3 origin(static_cast<double>(cubes.size()), 0.0, 0.0);
      cubes.push_back(Block::fromPoints({2, 2, 2}, origin, glm::dvec3(1.0), ScalarType::F32, values.data()));
    }
    generator.setBlocks(cubes);
    return generator.scalarRange();
  };
  CHECK(rangeOf({{-3.5F, -2.0F, nan, -infinite, -7.25F, infinite, -2.5F, -4.0F}}) ==
        ScalarRange{-7.25, -2.0});
  CHECK(rangeOf({{nan, nan, nan, nan, nan, nan, nan, nan}, {0, 0, 0, 0, 0, 0, 0, 0}}) ==
        ScalarRange{0.0, 0.0});
  CHECK(rangeOf({{-1, 0, 0, 0, 0, 0, 0, 0}, {0, 0, 0, 0, 0, 0, 0, 1e-3F}}) ==
        ScalarRange{-1.0, static_cast<double>(1e-3F)});
  CHECK(rangeOf({{-largest, 0, 0, 0, 0, 0, 0, largest}}) == ScalarRange{-largest, largest});
  CHECK(rangeOf({{nan, nan, nan, nan, nan, nan, nan, infinite}}) == ScalarRange());
  CHECK(device()->validationMessages() == "");
}

namespace {

/// Ghost layers that hold `garbage`, either everywhere or at edges and corners only.
struct Halos {
  ScalarType type;
  Joint joint;
  int layers;
  double garbage;
  bool onlyEdges = false;
};

/// The value at an index of the lattice.
double ownValue(const glm::ivec3& index) {
  return 20.0 + index.x + index.y + index.z;
}

/// A block whose values without ghost layers are those at [first, last).
Block withGarbage(const Halos& halos, const glm::ivec3& first, const glm::ivec3& last) {
  const glm::ivec3 dims = last - first + 2 * halos.layers;
  const IndexBox all{first - halos.layers, last + halos.layers};
  const auto valueAt = [&](const glm::ivec3& at) {
    const glm::ivec3 nearest = glm::clamp(at, first, last - 1);
    int outside = 0;
    for (int axis = 0; axis < 3; ++axis) outside += at[axis] != nearest[axis] ? 1 : 0;
    return outside > (halos.onlyEdges ? 1 : 0) ? halos.garbage : ownValue(nearest);
  };
  const std::shared_ptr<std::byte[]> values(new std::byte[all.count() * sizeOf(halos.type)]);
  for (int z = all.lo.z; z < all.hi.z; ++z) {
    for (int y = all.lo.y; y < all.hi.y; ++y) {
      for (int x = all.lo.x; x < all.hi.x; ++x) {
        const glm::ivec3 at(x, y, z);
        storeValue(halos.type, values.get(), all.position(at), valueAt(at));
      }
    }
  }
  const GhostLayers ghosts{glm::ivec3(halos.layers), glm::ivec3(halos.layers)};
  const glm::dvec3 corner(all.lo);
  const auto make = halos.joint == Joint::Cells ? &Block::fromCells : &Block::fromPoints;
  Block block = make(dims, corner, glm::dvec3(1.0), halos.type, values.get(), ghosts);
  block.keepAlive = values;
  return block;
}

}  // namespace

namespace {

void checkOwnRange(VdiGenerator& generator, const Halos& halos) {
  INFO(toString(halos.type) << ", joint " << static_cast<int>(halos.joint) << ", layers " << halos.layers
                            << ", " << halos.garbage);
  const glm::ivec3 size(20, 37, 18);
  const int shared = halos.joint == Joint::SharedPoints ? 1 : 0;
  const ScalarRange expected{ownValue(glm::ivec3(0)), ownValue(size - 1)};
  generator.setBlocks({withGarbage(halos, glm::ivec3(0), size)});
  CHECK(generator.scalarRange() == expected);
  std::vector<Block> eight;
  for (int i = 0; i < 8; ++i) {
    const glm::ivec3 upper(i % 2, i / 2 % 2, i / 4);
    const glm::ivec3 middle = size / 2;
    const glm::ivec3 last = glm::mix(middle + shared, size, glm::bvec3(upper));
    eight.push_back(withGarbage(halos, upper * middle, last));
  }
  generator.setBlocks(eight);
  CHECK(generator.scalarRange() == expected);
}

}  // namespace

TEST_CASE("the range is that of the values that blocks own, whatever ghost layers hold", "[pictures]") {
  // A generator opens a device's programs, which takes longer than the range does.
  VdiGenerator generator(device(), comm::Communicator::serial());
  for (const auto type :
       {ScalarType::U8, ScalarType::I16, ScalarType::F32, ScalarType::I32, ScalarType::F64}) {
    for (const auto joint : {Joint::Cells, Joint::SharedPoints, Joint::Gap}) {
      for (const int layers : {1, 3}) {
        checkOwnRange(generator, {type, joint, layers, 0.0});
        checkOwnRange(generator, {type, joint, layers, 1e30});
        // Anywhere but at edges, and in another type, values of this size are an error.
        if (type == ScalarType::F64) checkOwnRange(generator, {type, joint, layers, 1e305, true});
      }
    }
  }
  CHECK(device()->validationMessages() == "");
}

TEST_CASE("values that a finer block covers don't count for the range") {
  const auto type = GENERATE(ScalarType::U16, ScalarType::F32, ScalarType::F64);
  INFO(toString(type));
  std::vector<Block> blocks;
  const Halos halos{type, Joint::Cells, 0, 0.0};
  // The coarse block has a value of its own in the middle, where the fine block has others.
  const glm::ivec3 size(40, 20, 20);
  Block coarse = withGarbage(halos, glm::ivec3(0), size);
  const std::shared_ptr<std::byte[]> values(new std::byte[coarse.byteCount()]);
  const IndexBox covered{{10, 4, 4}, {34, 16, 16}};
  for (std::size_t i = 0; i < coarse.valueCount(); ++i)
    storeValue(type, values.get(), i, loadValue(type, coarse.data, i));
  storeValue(type, values.get(), coarse.stored().position({20, 10, 10}), 5000.0);
  storeValue(type, values.get(), coarse.stored().position({11, 5, 5}), 0.0);
  coarse.data = values.get();
  const std::vector<std::uint16_t> ones(24U * 24U * 48U, 30);
  Block fine =
      Block::fromCells({48, 24, 24}, glm::dvec3(covered.lo), glm::dvec3(0.5), ScalarType::U16, ones.data());
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks({coarse, fine});
  CHECK(generator.scalarRange() == ScalarRange{ownValue(glm::ivec3(0)), ownValue(size - 1)});
}

TEST_CASE("steps that are never shown, and invalid ones, leave the shown one intact", "[threads]") {
  const TimeStep first = timeStep("turbulence", {26, 22, 24}, ScalarType::F32);
  const TimeStep second = timeStep("shells", {26, 22, 24}, ScalarType::F32);
  VdiGenerator alone(device(), comm::Communicator::serial());
  const auto expected = frameAlone(alone, first);
  VdiGenerator generator(device(), comm::Communicator::serial());
  CHECK_THROWS_AS(generator.advance(), Error);  // no step was ever set
  generator.setBlocks(first.blocks);
  CHECK_THROWS_AS(generator.advance(), Error);
  CHECK(equal(*frame(generator, first), *expected));

  generator.setNextBlocks(second.blocks);
  CHECK_THROWS_AS(generator.setNextBlocks({withoutData()}), Error);
  CHECK_THROWS_AS(generator.advance(), Error);  // the invalid blocks replaced the earlier ones
  CHECK(equal(*frame(generator, first), *expected));

  generator.setNextBlocks(second.blocks);
  generator.setNextBlocks(first.blocks);  // replaces the earlier ones
  generator.advance();
  CHECK(equal(*frame(generator, first), *expected));

  generator.setNextBlocks(second.blocks);
  generator.setBlocks(first.blocks);  // drops them
  CHECK_THROWS_AS(generator.advance(), Error);
  CHECK(equal(*frame(generator, first), *expected));

  generator.setNextBlocks({});  // a step without blocks is valid
  generator.advance();
  CHECK(frame(generator, first)->supersegmentCount() == 0);
  generator.setNextBlocks(first.blocks);
  generator.advance();
  CHECK(equal(*frame(generator, first), *expected));

  generator.setNextBlocks(second.blocks);  // destroyed with the generator
  CHECK_THROWS_AS(generator.setBlocks({withoutData()}), Error);
  CHECK(frame(generator, first)->supersegmentCount() == 0);
  generator.setBlocks(first.blocks);
  generator.setNextBlocks(second.blocks);
  CHECK(device()->validationMessages() == "");
}
