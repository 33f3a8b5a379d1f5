// Arrays in any layout, from random strides. Layouts are copied as a plain loop reads them, and those that
// lead beyond the address space are refused. Each case has the same data in every run, for two
// seconds. With VDI_FUZZ_SECONDS=600 it continues with other data for that time. The test is also
// meant to run under sanitizers.
#include "catalyst_adaptor/StridedArray.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include "catalyst_adaptor/HostCopy.h"
#include "tests/Catch.h"
#include "tests/FuzzTime.h"

using namespace vdi;
using catalyst::StridedValues;

namespace {

using Random = std::mt19937_64;
__extension__ using Wide = __int128;

std::int64_t between(Random& random, std::int64_t low, std::int64_t high) {
  return std::uniform_int_distribution<std::int64_t>(low, high)(random);
}

/// The lowest and the highest offset of a byte of the values, in any width.
std::array<Wide, 2> extentOf(const StridedValues& values) {
  Wide low = 0;
  Wide high = static_cast<Wide>(values.scalarBytes) - 1;
  const auto add = [&](std::int64_t count, std::int64_t stride) {
    const Wide reach = static_cast<Wide>(count - 1) * stride;
    (reach < 0 ? low : high) += reach;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) add(values.counts[axis], values.strides[axis]);
  add(values.components, values.componentStride);
  return {low, high};
}

/// A layout in some of these: the usual order, axes swapped, padded, mirrored, repeated, unaligned.
StridedValues layoutOf(Random& random) {
  StridedValues values;
  for (std::int64_t& count : values.counts) count = between(random, 1, 9);
  values.components = static_cast<int>(between(random, 1, 4));
  values.scalarBytes = std::size_t{1} << static_cast<unsigned>(between(random, 0, 3));
  std::array<int, 4> order{0, 1, 2, 3};  // axes, and the components as the last
  if (between(random, 0, 2) > 0) {
    std::shuffle(order.begin(), order.end(), random);
  } else {
    std::rotate(order.begin(), order.begin() + 3, order.end());
  }
  auto next = static_cast<std::int64_t>(values.scalarBytes);
  for (const int axis : order) {
    const bool isComponent = axis == 3;
    std::int64_t& stride =
        isComponent ? values.componentStride : values.strides[static_cast<std::size_t>(axis)];
    stride = next;
    next *= isComponent ? values.components : values.counts[static_cast<std::size_t>(axis)];
    if (between(random, 0, 4) == 0) next += between(random, 1, 40);
    if (between(random, 0, 5) == 0) stride = -stride;
    if (between(random, 0, 9) == 0) stride = between(random, -20, 20);
  }
  return values;
}

/// Makes the copy as a GPU would, row by row.
void copyRows(const catalyst::RowCopy& rows, std::byte* to) {
  for (std::int64_t d = 0; d < rows.counts[3]; ++d) {
    for (std::int64_t c = 0; c < rows.counts[2]; ++c) {
      for (std::int64_t b = 0; b < rows.counts[1]; ++b) {
        for (std::int64_t a = 0; a < rows.counts[0]; ++a) {
          const auto at = [&](const std::array<std::int64_t, 4>& strides) {
            return a * strides[0] + b * strides[1] + c * strides[2] + d * strides[3];
          };
          std::memcpy(to + at(rows.toStrides), rows.from + at(rows.fromStrides), rows.rowBytes);
        }
      }
    }
  }
}

}  // namespace

TEST_CASE("any layout is copied as a plain loop reads it") {
  Random random(test::fuzzSeed());
  const test::FuzzTime time(2.0);
  do {
    StridedValues values = layoutOf(random);
    const auto [low, high] = extentOf(values);
    std::vector<std::byte> memory(static_cast<std::size_t>(high - low) + 1);
    for (std::byte& byte : memory) byte = static_cast<std::byte>(random());
    values.first = memory.data() - static_cast<std::ptrdiff_t>(low);
    REQUIRE(values.reachable());
    std::vector<std::byte> expected;
    for (std::int64_t z = 0; z < values.counts[2]; ++z) {
      for (std::int64_t y = 0; y < values.counts[1]; ++y) {
        for (std::int64_t x = 0; x < values.counts[0]; ++x) {
          for (std::int64_t c = 0; c < values.components; ++c) {
            const std::byte* const scalar = values.first + x * values.strides[0] + y * values.strides[1] +
                                            z * values.strides[2] + c * values.componentStride;
            expected.insert(expected.end(), scalar, scalar + values.scalarBytes);
          }
        }
      }
    }
    std::vector<std::byte> copy(values.bytes());
    values.copyTo(copy.data());
    REQUIRE(copy == expected);
    // The copy of a GPU's values holds the same, and takes only bytes of the values' extent.
    const catalyst::CopyPlan plan = catalyst::planCopy(values);
    const catalyst::MemoryRange source = plan.rows.source();
    REQUIRE((source.begin >= memory.data() && source.begin + source.bytes <= memory.data() + memory.size()));
    std::vector<std::byte> rows(plan.bytes);
    copyRows(plan.rows, rows.data());
    StridedValues copied = plan.copy;
    copied.first = rows.data() + plan.first;
    copied.copyTo(copy.data());
    REQUIRE(copy == expected);
    if (values.inOrder()) REQUIRE(std::memcmp(values.first, expected.data(), expected.size()) == 0);
  } while (!time.isOver());
}

TEST_CASE("a GPU copies few rows, and few bytes that aren't values") {
  const auto planOf = [](std::array<std::int64_t, 3> counts, std::array<std::int64_t, 3> strides) {
    static const std::array<std::byte, 1> somewhere{};
    StridedValues values;
    values.first = somewhere.data();
    values.counts = counts;
    values.strides = strides;
    values.scalarBytes = 8;
    return catalyst::planCopy(values);
  };
  const auto rowsOf = [](const catalyst::CopyPlan& plan) {
    return plan.rows.counts[0] * plan.rows.counts[1] * plan.rows.counts[2] * plan.rows.counts[3];
  };
  // In order, with one layer of halo, and as a part of an array of 512 values along each axis.
  CHECK(rowsOf(planOf({64, 64, 64}, {8, 512, 32768})) == 1);
  CHECK(rowsOf(planOf({64, 64, 64}, {8, 528, 34848})) == 1);
  const catalyst::CopyPlan part = planOf({64, 64, 64}, {8, 4096, 2097152});
  CHECK(rowsOf(part) == 64 * 64);
  CHECK(part.bytes == 64 * 64 * 64 * 8);
  CHECK(part.rows.counts[0] == 64);
  // One field of ten that are interleaved, and one layer of a large array.
  CHECK(rowsOf(planOf({64, 64, 64}, {80, 5120, 327680})) == 1);
  CHECK(planOf({1, 512, 512}, {8, 4096, 2097152}).bytes == 512 * 512 * 8);
}

TEST_CASE("strides lead beyond the address space exactly where wide numbers say so") {
  Random random(test::fuzzSeed());
  const test::FuzzTime time(2.0);
  constexpr std::int64_t most = std::numeric_limits<std::int64_t>::max();
  constexpr Wide addressSpace = static_cast<Wide>(1) << 64U;
  const auto any = [&]() -> std::int64_t {
    switch (between(random, 0, 4)) {
      case 0:
        return between(random, -100, 100);
      case 1:
        return -most - 1 + between(random, 0, 2);
      case 2:
        return most - between(random, 0, 2);
      case 3:
        return static_cast<std::int64_t>(random()) >> between(random, 0, 62);
      default:
        return between(random, -most / 64, most / 64);
    }
  };
  std::size_t refused = 0;
  do {
    StridedValues values;
    for (std::int64_t& count : values.counts)
      count = between(random, 0, 3) == 0 ? 1 : between(random, 1, std::numeric_limits<int>::max());
    for (std::int64_t& stride : values.strides) stride = any();
    values.components = static_cast<int>(between(random, 1, 16));
    values.componentStride = any();
    values.scalarBytes = 8;
    const auto address = static_cast<std::uintptr_t>(random());
    std::memcpy(&values.first, &address, sizeof address);  // never read
    const auto [low, high] = extentOf(values);
    const Wide first = static_cast<Wide>(address);
    const bool fits = first + low >= 0 && first + high < addressSpace &&
                      -low <= static_cast<Wide>(most) + 1 && high - 7 <= static_cast<Wide>(most);
    // Near the address space's end, either answer is good: no memory is there.
    const bool isAtEnd = first + high >= addressSpace - 16 && first + high < addressSpace;
    if (!isAtEnd) REQUIRE(values.reachable() == fits);
    refused += fits ? 0U : 1U;
  } while (!time.isOver());
  CHECK(refused > 100);
}
