// Time steps: the next step's blocks travel to the device while the current one is shown.
#include <array>
#include <cstring>
#include <limits>
#include <optional>
#include <variant>

#include "tests/Catch.h"
#include "tests/Devices.h"
#include "tests/Scenes.h"
#include "vdi/core/Error.h"
#include "vdi/pipeline/VdiGenerator.h"

using namespace vdi;
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

TEST_CASE("the next step's blocks don't change what's shown until advance, and then they're all that is") {
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

TEST_CASE("steps that are never shown, and invalid ones, leave the shown one intact") {
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
