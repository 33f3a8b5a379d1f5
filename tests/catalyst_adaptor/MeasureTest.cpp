// A condition's measures are those of the whole field, however it is distributed over ranks.
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "catalyst_adaptor/Fields.h"
#include "catalyst_adaptor/json/Measure.h"
#include "tests/Catch.h"
#include "vdi/comm/Communicator.h"

using namespace vdi;
using catalyst::Fields;
using catalyst::Measure;
using catalyst::StridedValues;
using Kind = config::RunCondition::Measure;

namespace {

constexpr int side = 12;  // cells of the domain, of unit spacing

std::optional<double> measured(Kind kind, const comm::Communicator& comm, Fields& fields,
                               int component = -1) {
  Measure measure(
      {.measure = kind, .field = "f", .cells = {}, .component = component, .above = {}, .below = {}});
  const std::optional<double> first = measure.of(comm, fields);
  CHECK(measure.of(comm, fields) == first);
  std::vector<double> same{first.value_or(0.0), -first.value_or(0.0)};
  comm.allReduceMax(same);
  CHECK(same[0] == Approx(-same[1]));
  return first;
}

/// This rank's slab along z, with ghost layers at its inner faces and `halo` of them at its outer ones.
struct Slab {
  Slab(const comm::Communicator& comm, int ghosts, int halo) {
    const int rank = comm.rank();
    const int size = comm.size();
    lo = rank * side / size;
    hi = (rank + 1) * side / size;
    below = rank == 0 ? halo : ghosts;
    above = rank == size - 1 ? halo : ghosts;
    block = {{side, side, hi - lo + below + above},
             {0, 0, below},
             {0, 0, above},
             {0.0, 0.0, double(lo - below)},
             {1.0, 1.0, 1.0}};
  }
  int lo = 0;
  int hi = 0;
  int below = 0;
  int above = 0;
  vdi_catalyst_block block{};
};

/// A polynomial in a point's coordinates.
double at(double x, double y, double z) {
  return 3.0 + x + 2.0 * y + 4.0 * z;
}

/// The field's values in the slab, with nonsense in all ghost layers.
template <typename Scalar>
std::vector<Scalar> valuesIn(const Slab& slab, bool cells) {
  const int more = cells ? 0 : 1;
  const double middle = cells ? 0.5 : 0.0;
  std::vector<Scalar> values;
  for (int z = 0; z < slab.block.cells[2] + more; ++z) {
    const bool isGhost = z < slab.below || z >= slab.block.cells[2] + more - slab.above;
    for (int y = 0; y < side + more; ++y) {
      for (int x = 0; x < side + more; ++x)
        values.push_back(static_cast<Scalar>(
            isGhost ? 120.0 : at(x + middle, y + middle, z + slab.lo - slab.below + middle)));
    }
  }
  return values;
}

template <typename Scalar>
void checkType(const comm::Communicator& comm, int type, bool cells) {
  INFO("type " << type << (cells ? ", cells" : ", points"));
  const Slab slab(comm, 1, 2);
  const std::vector<Scalar> values = valuesIn<Scalar>(slab, cells);
  Fields fields;
  fields.setBlocks({slab.block});
  fields.set(
      fields.arrayChange("f", cells, type, {fields.inOrder(slab.block, type, cells, 1, values.data())}));
  // Means of integers: cells' middles make 3 + 3.5 + 0.5 k.
  const double cut = std::is_integral_v<Scalar> && cells ? 0.5 : 0.0;
  const double half = cells ? 0.5 : 0.0;
  const double last = side - half;
  CHECK(*measured(Kind::Max, comm, fields) == at(last, last, last) - cut);
  CHECK(*measured(Kind::Min, comm, fields) == at(half, half, half) - cut);
  CHECK(*measured(Kind::Mean, comm, fields) == Approx(at(0.5 * side, 0.5 * side, 0.5 * side) - cut));
}

comm::Communicator world() {
  return comm::Communicator::world();
}

}  // namespace

TEST_CASE("ghost layers don't count, and points on a face between blocks count once, for all types") {
  const comm::Communicator comm = world();
  for (const bool cells : {true, false}) {
    checkType<std::uint8_t>(comm, VDI_CATALYST_U8, cells);
    checkType<std::int8_t>(comm, VDI_CATALYST_I8, cells);
    checkType<std::uint16_t>(comm, VDI_CATALYST_U16, cells);
    checkType<std::int16_t>(comm, VDI_CATALYST_I16, cells);
    checkType<std::uint32_t>(comm, VDI_CATALYST_U32, cells);
    checkType<std::int32_t>(comm, VDI_CATALYST_I32, cells);
    checkType<std::int64_t>(comm, VDI_CATALYST_I64, cells);
    checkType<std::uint64_t>(comm, VDI_CATALYST_U64, cells);
    checkType<float>(comm, VDI_CATALYST_F32, cells);
    checkType<double>(comm, VDI_CATALYST_F64, cells);
  }
}

TEST_CASE("components, magnitudes and values out of order are measured where they are") {
  const comm::Communicator comm = world();
  const Slab slab(comm, 0, 0);
  const int layers = slab.hi - slab.lo;
  // [x][y][z][3], z fastest, with a fourth number that isn't a component.
  std::vector<float> values;
  for (int x = 0; x < side; ++x) {
    for (int y = 0; y < side; ++y) {
      for (int z = slab.lo; z < slab.hi; ++z)
        values.insert(values.end(), {2.0F * float(z), -float(x), 0.0F, 1e9F});
    }
  }
  constexpr std::int64_t stride = 4 * sizeof(float);
  StridedValues strided;
  strided.first = reinterpret_cast<const std::byte*>(values.data());
  strided.counts = {side, side, layers};
  strided.strides = {stride * side * layers, stride * layers, stride};
  strided.components = 3;
  strided.componentStride = sizeof(float);
  strided.scalarBytes = sizeof(float);
  Fields fields;
  fields.setBlocks({slab.block});
  fields.set(fields.arrayChange("f", true, VDI_CATALYST_F32, {strided}));
  constexpr double last = side - 1.0;
  CHECK(*measured(Kind::Max, comm, fields, 0) == 2.0 * last);
  CHECK(*measured(Kind::Min, comm, fields, 1) == -last);
  CHECK(*measured(Kind::Mean, comm, fields, 1) == Approx(-0.5 * last));
  CHECK(*measured(Kind::Max, comm, fields) == Approx(std::sqrt(5.0) * last));
  CHECK_THROWS_WITH(measured(Kind::Max, comm, fields, 3),
                    test::ContainsSubstring("component 3 doesn't exist"));
}

TEST_CASE("what finer blocks cover doesn't count") {
  const comm::Communicator comm = world();
  // Rank 0 has the domain in cells of 2, the last rank an eighth of it in cells of 1.
  const vdi_catalyst_block coarse{{6, 6, 6}, {}, {}, {0.0, 0.0, 0.0}, {2.0, 2.0, 2.0}};
  const vdi_catalyst_block fine{{6, 6, 6}, {}, {}, {6.0, 6.0, 6.0}, {1.0, 1.0, 1.0}};
  std::vector<double> two(216, 2.0);
  for (int z = 3; z < 6; ++z) {
    for (int y = 3; y < 6; ++y) {
      for (int x = 3; x < 6; ++x) two[static_cast<std::size_t>(36 * z + 6 * y + x)] = 100.0;
    }
  }
  const std::vector<double> ten(216, 10.0);
  std::vector<vdi_catalyst_block> blocks;
  std::vector<const void*> data;
  if (comm.rank() == 0) {
    blocks.push_back(coarse);
    data.push_back(two.data());
  }
  if (comm.rank() == comm.size() - 1) {
    blocks.push_back(fine);
    data.push_back(ten.data());
  }
  Fields fields;
  fields.setBlocks(blocks);
  std::vector<StridedValues> values;
  for (std::size_t i = 0; i < blocks.size(); ++i)
    values.push_back(fields.inOrder(blocks[i], VDI_CATALYST_F64, true, 1, data[i]));
  fields.set(fields.arrayChange("f", true, VDI_CATALYST_F64, values));
  CHECK(*measured(Kind::Max, comm, fields) == 10.0);
  CHECK(*measured(Kind::Mean, comm, fields) == Approx(2.0 * 7.0 / 8.0 + 10.0 / 8.0));
}

TEST_CASE("NaN doesn't count, and infinite values count only for the extremes") {
  const comm::Communicator comm = world();
  const Slab slab(comm, 0, 0);
  constexpr double infinite = std::numeric_limits<double>::infinity();
  std::vector<double> values(static_cast<std::size_t>(side * side * (slab.hi - slab.lo)), 5.0);
  values[0] = std::numeric_limits<double>::quiet_NaN();
  values[1] = infinite;
  Fields fields;
  const auto set = [&] {
    fields.setBlocks({slab.block});
    fields.set(fields.arrayChange("f", true, VDI_CATALYST_F64,
                                  {fields.inOrder(slab.block, VDI_CATALYST_F64, true, 1, values.data())}));
  };
  set();
  CHECK(*measured(Kind::Max, comm, fields) == infinite);
  CHECK(*measured(Kind::Min, comm, fields) == 5.0);
  CHECK(*measured(Kind::Mean, comm, fields) == 5.0);
  values.assign(values.size(), std::numeric_limits<double>::quiet_NaN());
  set();
  CHECK_FALSE(measured(Kind::Max, comm, fields));
  CHECK_FALSE(measured(Kind::Mean, comm, fields));
  fields.setBlocks({});
  CHECK_FALSE(measured(Kind::Min, comm, fields));
}

TEST_CASE("blocks that lack the array don't count") {
  const comm::Communicator world = comm::Communicator::world();
  const std::vector<double> values(64, 2.0 + world.rank());
  const auto blockAt = [&](double x) {
    return vdi_catalyst_block{{4, 4, 4}, {0, 0, 0}, {0, 0, 0}, {x, 0.0, 4.0 * world.rank()}, {1.0, 1.0, 1.0}};
  };
  Fields fields;
  fields.setBlocks({blockAt(0.0), blockAt(4.0)});
  const auto in = [&](int block, const void* data) {
    return fields.inOrder(fields.blocks()[static_cast<std::size_t>(block)], VDI_CATALYST_F64, true, 1, data);
  };
  fields.set(fields.arrayChange("f", true, VDI_CATALYST_F64, {in(0, values.data()), in(1, nullptr)}));
  const double mean = 2.0 + 0.5 * (world.size() - 1);
  CHECK(measured(Kind::Mean, world, fields).value() == Approx(mean));
  // A measure notices when another block gets the array.
  Measure measure(
      {.measure = Kind::Mean, .field = "f", .cells = {}, .component = -1, .above = {}, .below = {}});
  CHECK(measure.of(world, fields).value() == Approx(mean));
  const std::vector<double> ones(64, 1.0);
  fields.set(fields.arrayChange("f", true, VDI_CATALYST_F64, {in(0, nullptr), in(1, ones.data())}));
  CHECK(measure.of(world, fields).value() == Approx(1.0));
  fields.set(fields.arrayChange("f", true, VDI_CATALYST_F64, {in(0, nullptr), in(1, nullptr)}));
  CHECK_THROWS(measure.of(world, fields));
}

TEST_CASE("a measure follows the array to another block with the same first point") {
  const comm::Communicator world = comm::Communicator::world();
  const auto blockOf = [&](double spacing) {
    return vdi_catalyst_block{
        {2, 2, 2}, {0, 0, 0}, {0, 0, 0}, {4.0 * world.rank(), 0.0, 0.0}, {spacing, spacing, spacing}};
  };
  Fields fields;
  fields.setBlocks({blockOf(1.0), blockOf(0.5)});
  Measure measure(
      {.measure = Kind::Max, .field = "f", .cells = {}, .component = -1, .above = {}, .below = {}});
  const std::vector<double> coarse(27, 2.0);
  const std::vector<double> fine(27, 3.0);
  for (const bool isFine : {false, true}) {
    const auto in = [&](std::size_t block, const void* data) {
      return fields.inOrder(fields.blocks()[block], VDI_CATALYST_F64, false, 1, data);
    };
    fields.set(
        fields.arrayChange("f", false, VDI_CATALYST_F64,
                           {in(0, isFine ? nullptr : coarse.data()), in(1, isFine ? fine.data() : nullptr)}));
    CHECK(measure.of(world, fields).value() == (isFine ? 3.0 : 2.0));
  }
}

TEST_CASE("a phase is measured, and an offset doesn't change what a value counts") {
  const comm::Communicator world = comm::Communicator::world();
  std::vector<double> pairs;
  for (int i = 0; i < 64; ++i) {
    pairs.push_back(3.0 * std::cos(0.5));
    pairs.push_back(3.0 * std::sin(0.5));
  }
  Fields fields;
  fields.setBlocks({{{4, 4, 4}, {0, 0, 0}, {0, 0, 0}, {0.0, 0.0, 4.0 * world.rank()}, {1.0, 1.0, 1.0}}});
  fields.set(
      fields.arrayChange("f", true, VDI_CATALYST_F64,
                         {fields.inOrder(fields.blocks()[0], VDI_CATALYST_F64, true, 2, pairs.data())}));
  CHECK(measured(Kind::Max, world, fields, phase).value() == Approx(0.5));
  CHECK(measured(Kind::Max, world, fields, magnitude).value() == Approx(3.0));
  std::vector<double> along;  // 0 to 3 along x
  for (int i = 0; i < 64; ++i) along.push_back(i % 4);
  fields.set(
      fields.arrayChange("g", true, VDI_CATALYST_F64,
                         {fields.inOrder(fields.blocks()[0], VDI_CATALYST_F64, true, 1, along.data())}));
  Measure mean({.measure = Kind::Mean, .field = "g", .cells = {}, .component = -1, .above = {}, .below = {}});
  CHECK(mean.of(world, fields).value() == Approx(1.5));
  fields.set(Fields::offsetChange("g", true, {-0.5, 0.0, 0.0}));
  CHECK(mean.of(world, fields).value() == Approx(1.5));
}

TEST_CASE("the mean of a staggered field is the same for one slab and for two") {
  const comm::Communicator world = comm::Communicator::world();
  const bool cells = GENERATE(true, false);
  const double offset = GENERATE(-0.5, 0.25, 0.5);
  INFO((cells ? "cells, offset " : "points, offset ") << offset);
  const auto blockAt = [&](int first, int count) {
    return vdi_catalyst_block{
        {count, 1, 1}, {0, 0, 0}, {0, 0, 0}, {1.0 * first, 0.0, 1.0 * world.rank()}, {1.0, 1.0, 1.0}};
  };
  constexpr int length = 8;
  const auto square = [](int x) { return static_cast<double>(x * x); };
  // Squares along x: a wrong weight at either end of a slab changes their mean.
  const auto valuesOf = [&](const vdi_catalyst_block& block) {
    const int more = cells ? 0 : 1;
    std::vector<double> values;
    for (int row = 0; row < (1 + more) * (1 + more); ++row) {
      for (int x = 0; x < block.cells[0] + more; ++x)
        values.push_back(square(static_cast<int>(block.origin[0]) + x));
    }
    return values;
  };
  double sum = 0.0;
  for (int x = 0; x < length; ++x) sum += cells ? square(x) : 0.5 * (square(x) + square(x + 1));
  for (const int split : {0, 3}) {
    std::vector<vdi_catalyst_block> blocks{blockAt(split, length - split)};
    if (split > 0) blocks.push_back(blockAt(0, split));
    Fields fields;
    fields.setBlocks(blocks);
    fields.set(Fields::offsetChange("f", cells, {offset, 0.0, 0.0}));
    std::vector<std::vector<double>> values;
    std::vector<StridedValues> strided;
    for (const vdi_catalyst_block& block : blocks) {
      const std::vector<double>& own = values.emplace_back(valuesOf(block));
      strided.push_back(fields.inOrder(block, VDI_CATALYST_F64, cells, 1, own.data()));
    }
    fields.set(fields.arrayChange("f", cells, VDI_CATALYST_F64, strided));
    CHECK(*measured(Kind::Mean, world, fields) == Approx(sum / length));
    CHECK(*measured(Kind::Max, world, fields) == square(cells ? length - 1 : length));
    CHECK(*measured(Kind::Min, world, fields) == 0.0);
  }
}
