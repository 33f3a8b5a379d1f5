// Blocks read the same values, however these lie in memory.
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <string_view>
#include <vector>

#include "tests/Catch.h"
#include "tests/FuzzTime.h"
#include "tests/Layouts.h"
#include "vdi/core/Block.h"
#include "vdi/core/ComponentValues.h"

using namespace vdi;

namespace {

/// Values of all magnitudes, some of them not finite, in order.
Block blockOf(ScalarType type, const glm::ivec3& dims, std::mt19937& random) {
  const auto count =
      static_cast<std::size_t>(dims.x) * static_cast<std::size_t>(dims.y) * static_cast<std::size_t>(dims.z);
  const std::shared_ptr<std::byte[]> values(new std::byte[count * sizeOf(type)]);
  std::uniform_real_distribution<double> value(-120.0, 120.0);
  for (std::size_t i = 0; i < count; ++i) storeValue(type, values.get(), i, value(random));
  if (type == ScalarType::F32 || type == ScalarType::F64) {
    storeValue(type, values.get(), count / 2, std::numeric_limits<double>::quiet_NaN());
    storeValue(type, values.get(), count / 3, std::numeric_limits<double>::infinity());
  }
  Block block = Block::fromPoints(dims, glm::dvec3(0.0), glm::dvec3(1.0), type, values.get());
  block.keepAlive = std::shared_ptr<const void>(values, values.get());
  return block;
}

/// The stored values of a box, in order.
std::vector<std::byte> bytesOf(const Block& block, const IndexBox& box) {
  std::vector<std::byte> bytes(box.count() * sizeOf(block.type));
  block.copyTo(box, bytes.data());
  return bytes;
}

/// Whether both blocks read the same everywhere, and in a part.
void requireSame(const Block& seen, const Block& expected, const IndexBox& part) {
  REQUIRE(bytesOf(seen, seen.stored()) == bytesOf(expected, expected.stored()));
  REQUIRE(bytesOf(seen, part) == bytesOf(expected, part));
  const auto sameNumber = [](double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); };
  REQUIRE(sameNumber(storedValueAt(seen, part.lo), storedValueAt(expected, part.lo)));
  REQUIRE(sameNumber(valueAt(seen, part.lo.x, part.lo.y, part.lo.z),
                     valueAt(expected, part.lo.x, part.lo.y, part.lo.z)));
  REQUIRE(ownRange(seen) == ownRange(expected));
  const ValueSizes a = valueSizesOf(std::span(&seen, 1));
  const ValueSizes b = valueSizesOf(std::span(&expected, 1));
  REQUIRE((a.usable == b.usable && a.tooSmall == b.tooSmall));
  // The tiles cover the part once.
  const Tiling tiles = seen.tilesOf(part);
  std::size_t values = 0;
  for (std::size_t i = 0; i < tiles.count(); ++i) {
    REQUIRE(tiles[i] == tiles[i].intersection(part));
    REQUIRE(tiles[i].count() <= std::size_t{Tiling::values});
    values += tiles[i].count();
  }
  REQUIRE(values == part.count());
}

template <typename T>
ComponentArray arrayOf(const std::vector<T>& values, const glm::ivec3& dims, int components,
                       ComponentType type) {
  return {reinterpret_cast<const std::byte*>(values.data()),
          packedStrides(dims, sizeof(T)) * std::int64_t{components}, type, components, sizeof(T)};
}

}  // namespace

TEST_CASE("a block reads the same values in any layout") {
  std::mt19937 random(1);
  const auto type = GENERATE(ScalarType::U8, ScalarType::I16, ScalarType::F32, ScalarType::F64);
  const auto dims = GENERATE(glm::ivec3(37, 20, 18), glm::ivec3(1, 33, 2), glm::ivec3(5000, 2, 1));
  const Block packed = blockOf(type, dims, random);
  for (const test::Layout& layout : test::layouts()) {
    INFO(layout.name);
    const Block block = test::laidOut(packed, layout);
    if (std::string_view(layout.name) == "packed") CHECK(block.isPacked());
    if (layout.stride > 1) CHECK(!block.isPacked());
    requireSame(block, packed, {dims / 3, dims - dims / 4});
  }
}

TEST_CASE("a stride of 0 repeats values") {
  const std::vector<float> row{1.0F, -2.0F, 3.0F, 4.0F};
  Block block = Block::fromPoints({4, 3, 5}, glm::dvec3(0.0), glm::dvec3(1.0), ScalarType::F32, row.data());
  block.setStrides({sizeof(float), 0, 0});
  CHECK(!block.isPacked());
  CHECK(valueAt(block, 1, 2, 4) == -2.0);
  CHECK(ownRange(block) == ScalarRange{-2.0, 4.0});
  block.setStrides({0, 0, 0});
  CHECK(valueAt(block, 3, 2, 4) == 1.0);
  CHECK(ownRange(block) == ScalarRange{1.0, 1.0});
}

TEST_CASE("strides that say that values are packed leave a block packed") {
  const std::vector<double> values(60, 1.0);
  Block block =
      Block::fromPoints({4, 3, 5}, glm::dvec3(0.0), glm::dvec3(1.0), ScalarType::F64, values.data());
  block.setStrides({8, 32, 96});
  CHECK(block.isPacked());
  block.setStrides({8, 32, 97});
  CHECK(!block.isPacked());
  block.dims.z = 1;
  block.setStrides({8, 32, -7});  // has no effect
  CHECK(block.isPacked());
  block.data = reinterpret_cast<const std::byte*>(values.data()) + 1;
  block.setStrides({8, 32, 96});
  CHECK(!block.isPacked());
}

TEST_CASE("random layouts read as packed ones do") {
  std::mt19937 random(2);
  const test::FuzzTime time(1.0);
  constexpr std::array types{ScalarType::U8,  ScalarType::I8,  ScalarType::U16, ScalarType::I16,
                             ScalarType::U32, ScalarType::I32, ScalarType::F32, ScalarType::F64};
  int rounds = 0;
  do {
    const auto upTo = [&random](int least, int most) {
      return std::uniform_int_distribution<int>(least, most)(random);
    };
    const ScalarType type = types[static_cast<std::size_t>(upTo(0, 7))];
    const glm::ivec3 dims(upTo(1, 50), upTo(1, 40), upTo(1, 40));
    const glm::ivec3 lo(upTo(0, dims.x - 1), upTo(0, dims.y - 1), upTo(0, dims.z - 1));
    const glm::ivec3 hi(upTo(lo.x + 1, dims.x), upTo(lo.y + 1, dims.y), upTo(lo.z + 1, dims.z));
    const test::Layout layout = test::randomLayout(random);
    INFO("axes " << layout.axes[0] << layout.axes[1] << layout.axes[2] << ", stride " << layout.stride
                 << ", shift " << layout.shift << ", " << dims.x << " x " << dims.y << " x " << dims.z);
    const Block packed = blockOf(type, dims, random);
    requireSame(test::laidOut(packed, layout), packed, {lo, hi});
    ++rounds;
  } while (!time.isOver());
  CHECK(rounds > 0);
}

TEST_CASE("components are shown as they are, or as doubles that are computed") {
  const glm::ivec3 dims(21, 19, 17);
  const auto count =
      static_cast<std::size_t>(dims.x) * static_cast<std::size_t>(dims.y) * static_cast<std::size_t>(dims.z);
  Block block = Block::fromCells(dims, glm::dvec3(0.0), glm::dvec3(1.0), ScalarType::U8, nullptr);
  const IndexBox part{{1, 2, 3}, {20, 5, 17}};

  SECTION("of vectors") {
    std::vector<float> values(3 * count);
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = static_cast<float>((i * 7919) % 1000) - 500.0F;
    std::vector<double> lengths(count);
    for (std::size_t i = 0; i < count; ++i) {
      double sum = 0.0;
      for (std::size_t c = 0; c < 3; ++c) sum += double(values[3 * i + c]) * double(values[3 * i + c]);
      lengths[i] = std::sqrt(sum);
    }
    Block expected =
        Block::fromCells(dims, glm::dvec3(0.0), glm::dvec3(1.0), ScalarType::F64, lengths.data());
    showComponent(block, arrayOf(values, dims, 3, ComponentType::F32), magnitude);
    CHECK(block.type == ScalarType::F64);
    requireSame(block, expected, part);
    showComponent(block, arrayOf(values, dims, 3, ComponentType::F32), 2);
    CHECK(block.type == ScalarType::F32);
    CHECK(block.computed == nullptr);
    CHECK(block.data == &values[2]);
    CHECK(valueAt(block, 4, 5, 6) == double(values[3 * block.stored().position({4, 5, 6}) + 2]));
  }
  SECTION("of complex numbers") {
    std::vector<std::complex<double>> numbers(count);
    std::vector<double> angles(count);
    for (std::size_t i = 0; i < count; ++i) {
      angles[i] = (double((i * 31) % 200) / 100.0 - 0.995) * std::numbers::pi;
      numbers[i] = std::polar(1.0 + double(i % 5), angles[i]);
    }
    numbers[7] = 0.0;
    angles[7] = 0.0;
    const ComponentArray array{reinterpret_cast<const std::byte*>(numbers.data()),
                               packedStrides(dims, sizeof numbers[0]), ComponentType::F64, 2, sizeof(double)};
    showComponent(block, array, phase);
    CHECK(block.type == ScalarType::F64);
    std::vector<double> seen(count);
    block.copyTo(block.stored(), seen.data());
    double worst = 0.0;
    for (std::size_t i = 0; i < count; ++i) worst = std::max(worst, std::abs(seen[i] - angles[i]));
    CHECK(worst < 1e-14);
    showComponent(block, array, magnitude);
    CHECK(valueAt(block, 3, 0, 0) == Approx(4.0).epsilon(1e-12));
  }
  SECTION("of 64-bit integers") {
    std::vector<std::int64_t> values(count);
    for (std::size_t i = 0; i < count; ++i)
      values[i] = (std::int64_t{1} << 40) * (i % 2 == 0 ? 1 : -1) + static_cast<std::int64_t>(i);
    showComponent(block, arrayOf(values, dims, 1, ComponentType::I64), magnitude);
    CHECK(block.type == ScalarType::F64);
    CHECK(storedValueAt(block, {1, 0, 0}) == double(values[1]));
    CHECK(storedValueAt(block, dims - 1) == double(values.back()));
    CHECK(ownRange(block).min == double(*std::min_element(values.begin(), values.end())));
    const std::vector<std::uint64_t> large(count, std::numeric_limits<std::uint64_t>::max());
    showComponent(block, arrayOf(large, dims, 1, ComponentType::U64), magnitude);
    CHECK(storedValueAt(block, {1, 1, 1}) == 0x1p64);
  }
  SECTION("of which some are missing") {
    std::vector<std::int16_t> values(count);
    for (std::size_t i = 0; i < count; ++i)
      values[i] = static_cast<std::int16_t>(i % 3 == 0 ? -9999 : 1 + i % 500);
    ComponentArray array = arrayOf(values, dims, 1, ComponentType::I16);
    array.missing = {-9999.0, 0.5, 1e20};
    showComponent(block, array, magnitude);
    CHECK(block.type == ScalarType::F32);
    std::vector<float> seen(part.count());
    block.copyTo(part, seen.data());
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const glm::ivec3 size = part.size();
      const glm::ivec3 at(i % size.x, i / size.x % size.y, i / (size.x * size.y));
      const std::int16_t value = values[block.stored().position(part.lo + at)];
      REQUIRE((value == -9999 ? std::isnan(seen[i]) : seen[i] == value));
    }
    CHECK(ownRange(block).min == 1.0);
    array.missing = {0.5, 40000.0};  // numbers that no value can be
    showComponent(block, array, magnitude);
    CHECK(block.type == ScalarType::I16);
    CHECK(block.computed == nullptr);
  }
  SECTION("of vectors that lack components") {
    std::vector<double> values(2 * count, 3.0);
    values[2 * 5 + 1] = 1e20;
    ComponentArray array = arrayOf(values, dims, 2, ComponentType::F64);
    array.missing = {1e20};
    for (const int component : {1, magnitude, phase}) {
      showComponent(block, array, component);
      CHECK(std::isnan(storedValueAt(block, {5, 0, 0})));
      CHECK(std::isfinite(storedValueAt(block, {4, 0, 0})));
    }
    showComponent(block, array, 0);
    CHECK(storedValueAt(block, {5, 0, 0}) == 3.0);
  }
  SECTION("with a block's own values, in single precision and of 64 bits") {
    const std::vector<float> values{1.0F, 0.1F, 1e20F, 4.0F};
    Block line =
        Block::fromCells({4, 1, 1}, glm::dvec3(0.0), glm::dvec3(1.0), ScalarType::F32, values.data());
    leaveOutMissing(line, std::array{0.1, 1e20});  // neither is a float
    CHECK(ownRange(line) == ScalarRange{1.0, 4.0});
    CHECK(std::isnan(storedValueAt(line, {2, 0, 0})));
    const std::vector<std::int64_t> wide{std::numeric_limits<std::int64_t>::min(), 7, -9999,
                                         std::numeric_limits<std::int64_t>::max()};
    ComponentArray array = arrayOf(wide, {4, 1, 1}, 1, ComponentType::I64);
    array.missing = {-9999.0, -0x1p63, 0x1p63};
    showComponent(line, array, magnitude);
    CHECK(ownRange(line) == ScalarRange{7.0, 7.0});
  }
}
