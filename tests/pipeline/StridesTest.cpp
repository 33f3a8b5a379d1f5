// VDIs don't depend on where the blocks' values lie in memory.
#include <sched.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "tests/Catch.h"
#include "tests/Devices.h"
#include "tests/Layouts.h"
#include "tests/Scenes.h"
#include "vdi/core/ComponentValues.h"
#include "vdi/pipeline/VdiGenerator.h"

using namespace vdi;
using synthetic::Joint;

namespace {

std::vector<Block> decomposed(const glm::ivec3& size, const glm::ivec3& blocks, Joint joint,
                              ScalarType type) {
  return test::onOneRank("turbulence", size, blocks, type, joint).mine;
}

/// `top`: the highest scalar.
CompactLists listsOf(const std::vector<Block>& blocks, double top, bool gpuPrograms = false) {
  VdiGenerator generator(test::device(gpuPrograms), comm::Communicator::serial());
  generator.setBlocks(blocks);
  const std::optional<Vdi> vdi =
      generator.generate(test::oblique(), test::threeHues(top * 0.8), test::smallSettings(47, 35, 8));
  return std::get<CompactLists>(vdi->lists);
}

CompactLists listsOf(const std::vector<Block>& blocks, ScalarType type) {
  return listsOf(blocks, test::topOf(type));
}

bool equal(const CompactLists& a, const CompactLists& b) {
  return a.offsets == b.offsets && a.segments.size() == b.segments.size() &&
         std::memcmp(a.segments.data(), b.segments.data(), a.segments.size() * sizeof(a.segments[0])) == 0;
}

std::vector<Block> laidOut(std::vector<Block> blocks, const test::Layout& layout) {
  for (Block& block : blocks) block = test::laidOut(block, layout);
  return blocks;
}

/// Copies of the blocks. Some of their floats are infinite, or not a number.
std::vector<Block> withHoles(std::vector<Block> blocks) {
  for (Block& block : blocks) {
    const auto values = std::make_shared<std::vector<std::byte>>(block.byteCount());
    block.copyTo(block.stored(), values->data());
    if (block.type == ScalarType::F32 || block.type == ScalarType::F64) {
      constexpr double infinity = std::numeric_limits<double>::infinity();
      storeValue(block.type, values->data(), block.valueCount() / 3, infinity);
      storeValue(block.type, values->data(), block.valueCount() / 2, -infinity);
      storeValue(block.type, values->data(), block.valueCount() / 4, std::nan(""));
    }
    block.data = values->data();
    block.keepAlive = values;
  }
  return blocks;
}

/// Restricts this thread, and those that it starts, to one core while it exists.
class OneCore {
 public:
  OneCore() {
    REQUIRE(sched_getaffinity(0, sizeof before_, &before_) == 0);
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(sched_getcpu(), &one);
    REQUIRE(sched_setaffinity(0, sizeof one, &one) == 0);
  }
  ~OneCore() { sched_setaffinity(0, sizeof before_, &before_); }
  OneCore(const OneCore&) = delete;
  OneCore& operator=(const OneCore&) = delete;
  OneCore(OneCore&&) = delete;
  OneCore& operator=(OneCore&&) = delete;

 private:
  cpu_set_t before_{};
};

}  // namespace

TEST_CASE("a VDI is the same in any layout of its blocks' values", "[long]") {
  const auto type = GENERATE(ScalarType::U8, ScalarType::I16, ScalarType::F32, ScalarType::F64);
  const std::vector<Block> packed = decomposed({27, 22, 24}, {2, 1, 2}, Joint::Cells, type);
  const CompactLists expected = listsOf(packed, type);
  CHECK(expected.segments.size() > 1000);
  for (const test::Layout& layout : test::layouts()) {
    INFO(layout.name);
    CHECK(equal(listsOf(laidOut(packed, layout), type), expected));
  }
  CHECK(test::device()->validationMessages() == "");
}

TEST_CASE("a shader makes the texels that the host makes of values of any type") {
  const auto type = GENERATE(ScalarType::U8, ScalarType::I8, ScalarType::U16, ScalarType::I16,
                             ScalarType::U32, ScalarType::I32, ScalarType::F32, ScalarType::F64);
  INFO(toString(type));
  for (const glm::ivec3& count : {glm::ivec3(1), glm::ivec3(3, 2, 2)}) {
    const std::vector<Block> blocks = withHoles(decomposed({27, 22, 24}, count, Joint::Cells, type));
    const CompactLists expected = listsOf(blocks, test::topOf(type));
    CHECK(expected.segments.size() > 1000);
    CHECK(equal(listsOf(blocks, test::topOf(type), true), expected));
  }
  CHECK(test::device(true)->validationMessages() == "");
}

TEST_CASE("a device that reads rows and slices from the host's memory finds them", "[pictures]") {
  const OneCore one;  // with more cores, the host copies the values
  const auto type = GENERATE(ScalarType::U8, ScalarType::U16, ScalarType::F32);
  const std::vector<Block> packed = decomposed({104, 106, 108}, glm::ivec3(1), Joint::SharedPoints, type);
  const CompactLists expected = listsOf(packed, type);
  CHECK(expected.segments.size() > 1000);
  for (const test::Layout& layout : test::layouts()) {
    INFO(layout.name);
    CHECK(equal(listsOf(laidOut(packed, layout), type), expected));
  }
  CHECK(test::device()->validationMessages() == "");
}

TEST_CASE("computed values make the VDI that an array of them makes") {
  const glm::ivec3 dims(26, 24, 22);
  std::vector<float> vectors(3 * IndexBox{glm::ivec3(0), dims}.count());
  std::vector<double> lengths(vectors.size() / 3);
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    double sum = 0.0;
    for (std::size_t c = 0; c < 3; ++c) {
      vectors[3 * i + c] = static_cast<float>((i * (c + 3)) % 97) / 100.0F;
      sum += double(vectors[3 * i + c]) * double(vectors[3 * i + c]);
    }
    lengths[i] = std::sqrt(sum);
  }
  const glm::dvec3 spacing = 1.0 / glm::dvec3(dims);
  const Block array = Block::fromCells(dims, glm::dvec3(0.0), spacing, ScalarType::F64, lengths.data());
  Block computed = Block::fromCells(dims, glm::dvec3(0.0), spacing, ScalarType::F64, vectors.data());
  constexpr std::int64_t bytes = sizeof(float);
  showComponent(computed,
                {reinterpret_cast<const std::byte*>(vectors.data()),
                 packedStrides(dims, sizeof(float)) * std::int64_t{3}, ComponentType::F32, 3, bytes},
                magnitude);
  const CompactLists expected = listsOf({array}, 1.6);
  CHECK(expected.segments.size() > 1000);
  CHECK(equal(listsOf({computed}, 1.6), expected));
}
