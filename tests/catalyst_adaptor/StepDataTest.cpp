// Tests that a step's data reach the process unchanged.
#include "catalyst_adaptor/isolated/StepData.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "catalyst_adaptor/Fields.h"
#include "catalyst_adaptor/ParticleArray.h"
#include "catalyst_adaptor/isolated/Messages.h"
#include "tests/Catch.h"

using namespace vdi::catalyst;

namespace {

vdi_catalyst_block blockAt(double x, int cells) {
  vdi_catalyst_block block{};
  for (int axis = 0; axis < 3; ++axis) {
    block.cells[axis] = cells;
    block.spacing[axis] = 0.5;
  }
  block.origin[0] = x;
  return block;
}

const std::array<float, 8> zeros{};

/// A block of 2 x 2 x 2 cells with the array "E", whose values are zeros.
Fields smallFields() {
  Fields fields;
  fields.setBlocks({blockAt(0.0, 2)});
  fields.set(
      fields.arrayChange("E", true, VDI_CATALYST_F32,
                         {fields.inOrder(fields.blocks()[0], VDI_CATALYST_F32, true, 1, zeros.data())}));
  return fields;
}

/// A step's bytes, aligned as pages are.
struct Bytes {
  explicit Bytes(const StepWriter& writer) : words((writer.bytes() + 7) / 8) {
    writer.write(std::as_writable_bytes(std::span(words)));
  }
  std::span<const std::byte> all() const { return std::as_bytes(std::span(words)); }
  std::vector<std::uint64_t> words;
};

StepFields stepOf(const Fields& fields) {
  StepFields step;
  step.arrays = fields.arrays();
  for (const auto& [name, particles] : fields.particles())
    step.particles.push_back({name, particles, fields.offsetOf(name, true), fields.missingOf(name, true)});
  return step;
}

template <typename Number>
Number numberAt(const void* from, std::size_t index) {
  Number number;
  std::memcpy(&number, static_cast<const std::byte*>(from) + index * sizeof number, sizeof number);
  return number;
}

}  // namespace

TEST_CASE("fields arrive: strides, offsets, blocks that lack an array, particles, parameters") {
  Fields fields;
  fields.setBlocks({blockAt(0.0, 2), blockAt(1.0, 3)});
  // z fastest, the second component of two; the second block lacks the array.
  const std::array<std::array<double, 2>, 8> interleaved{
      {{0, 10}, {1, 11}, {2, 12}, {3, 13}, {4, 14}, {5, 15}, {6, 16}, {7, 17}}};
  StridedValues values = fields.inOrder(fields.blocks()[0], VDI_CATALYST_F64, true, 1, &interleaved[0][1]);
  values.strides = {64, 32, 16};
  const StridedValues missing = fields.inOrder(fields.blocks()[1], VDI_CATALYST_F64, true, 1, nullptr);
  fields.set(fields.arrayChange("E", true, VDI_CATALYST_F64, {values, missing}));
  fields.set(Fields::offsetChange("E", true, {-0.5, 0.0, 0.25}));
  fields.set(Fields::missingChange("E", true, {-9999.0, 1e20}));

  // Positions from the last to the first, one weight for all, no lengths.
  const std::array<float, 6> positions{1, 2, 3, 4, 5, 6};
  const double weight = 2.5;
  vdi_catalyst_particles given{};
  given.count = 2;
  given.kind = VDI_CATALYST_DENSITY;
  given.position_type = VDI_CATALYST_F32;
  for (std::size_t axis = 0; axis < 3; ++axis) given.positions[axis] = &positions[3 + axis];
  given.position_stride = -12;
  given.weights = &weight;
  given.weight_type = VDI_CATALYST_F64;
  given.periodic[1] = 1;
  fields.set(Fields::missingChange("stars", true, {0.0}));
  fields.set(Fields::offsetChange("stars", true, {0.25, 0.0, -0.5}));
  fields.set(fields.particlesChange("stars", particleArrayOf(&given)));

  const StepFields step = stepOf(fields);
  const Bytes bytes(StepWriter(7, fields.blocks(), step, {{"feed", false, 0.5, 0.0, 1.0}}));
  const StepData got = StepData::read(bytes.all());

  CHECK(got.version == 7);
  REQUIRE(got.blocks.size() == 2);
  CHECK((got.blocks[1].cells[0] == 3 && got.blocks[1].origin[0] == 1.0));
  REQUIRE(got.arrays.size() == 1);
  const StepData::Array& array = got.arrays[0];
  CHECK((array.name == "E" && array.cells && array.type == VDI_CATALYST_F64 && array.components == 1));
  CHECK((array.offset[0] == -0.5 && array.offset[1] == 0.0 && array.offset[2] == 0.25));
  CHECK(array.missing == std::vector{-9999.0, 1e20});
  REQUIRE(array.blocks.size() == 2);
  CHECK(array.blocks[1] == nullptr);
  for (std::size_t x = 0; x < 2; ++x) {
    for (std::size_t y = 0; y < 2; ++y) {
      for (std::size_t z = 0; z < 2; ++z) {
        CHECK(numberAt<double>(array.blocks[0], (z * 2 + y) * 2 + x) ==
              static_cast<double>(10 + (x * 2 + y) * 2 + z));
      }
    }
  }

  REQUIRE(got.particles.size() == 1);
  const vdi_catalyst_particles& stars = got.particles[0].given;
  const auto& offset = got.particles[0].offset;
  CHECK((offset[0] == 0.25 && offset[1] == 0.0 && offset[2] == -0.5));
  CHECK((stars.periodic[0] == 0 && stars.periodic[1] == 1 && got.particles[0].missing == std::vector{0.0}));
  CHECK((got.particles[0].name == "stars" && stars.count == 2 && stars.kind == VDI_CATALYST_DENSITY));
  CHECK((stars.position_type == VDI_CATALYST_F32 && stars.position_stride == sizeof(float)));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    CHECK(numberAt<float>(stars.positions[axis], 0) == static_cast<float>(4 + axis));
    CHECK(numberAt<float>(stars.positions[axis], 1) == static_cast<float>(1 + axis));
  }
  CHECK((stars.weight_stride == 0 && numberAt<double>(stars.weights, 0) == 2.5));
  CHECK(stars.lengths == nullptr);
  // The engine accepts them like a simulation's.
  CHECK_NOTHROW(particleArrayOf(&stars));

  REQUIRE(got.parameters.size() == 1);
  CHECK((got.parameters[0].name == "feed" && got.parameters[0].value == 0.5));
}

TEST_CASE("no particles, and no blocks, arrive as none") {
  Fields fields;
  fields.setBlocks({});
  fields.set(fields.arrayChange("E", true, VDI_CATALYST_F32, {}));
  vdi_catalyst_particles given{};
  fields.set(fields.particlesChange("stars", particleArrayOf(&given)));
  const StepFields step = stepOf(fields);
  const Bytes bytes(StepWriter(1, fields.blocks(), step, {}));
  const StepData got = StepData::read(bytes.all());
  REQUIRE(got.arrays.size() == 1);
  CHECK(got.arrays[0].blocks.empty());
  REQUIRE(got.particles.size() == 1);
  CHECK(got.particles[0].given.count == 0);
  CHECK_NOTHROW(particleArrayOf(&got.particles[0].given));
}

TEST_CASE("steps that are left out arrive with their times") {
  Packer packer;
  LeftOutSteps{{{3, 0.5}, {std::int64_t{1} << 40, -1.0}}}.pack(packer);
  Unpacker unpacker(packer.bytes());
  const LeftOutSteps got = LeftOutSteps::unpack(unpacker);
  REQUIRE(got.steps.size() == 2);
  CHECK((got.steps[0].step == 3 && got.steps[0].time == 0.5));
  CHECK((got.steps[1].step == std::int64_t{1} << 40 && got.steps[1].time == -1.0));
}

TEST_CASE("a step that is cut short is refused") {
  Fields fields = smallFields();
  const StepFields step = stepOf(fields);
  const Bytes bytes(StepWriter(1, fields.blocks(), step, {}));
  for (const std::size_t size : {0U, 7U, 20U, 100U}) {
    CHECK_THROWS_AS(StepData::read(bytes.all().first(size)), std::runtime_error);
  }
}

TEST_CASE("a step whose values would lie outside its memory is refused") {
  Fields fields = smallFields();
  vdi_catalyst_particles given{};
  given.count = 7;
  given.position_type = VDI_CATALYST_F32;
  given.position_stride = sizeof(float);
  for (const void*& position : given.positions) position = zeros.data();
  fields.set(fields.particlesChange("stars", particleArrayOf(&given)));
  Bytes bytes(StepWriter(1, fields.blocks(), stepOf(fields), {}));
  const std::span<std::byte> all = std::as_writable_bytes(std::span(bytes.words));
  REQUIRE_NOTHROW(StepData::read(all));
  // Puts a number where the head has another one, and takes it back when it has been read.
  const auto refuses = [&](std::size_t place, const auto& number) {
    std::array<std::byte, sizeof number> before{};
    std::memcpy(before.data(), &all[place], sizeof number);
    std::memcpy(&all[place], &number, sizeof number);
    CHECK_THROWS_AS(StepData::read(all), std::runtime_error);
    std::memcpy(&all[place], before.data(), sizeof number);
  };
  const auto places = [&](const auto& number) {
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i + sizeof number <= 4096; ++i) {
      if (std::memcmp(&all[i], &number, sizeof number) == 0) found.push_back(i);
    }
    return found;
  };
  const std::size_t block = 3 * sizeof(std::uint64_t);  // after the head's size, the version and the count
  for (const std::int32_t cells : {0, -1, 100000, 2147483647}) refuses(block + 4, cells);
  const std::array<char, 2> name{'E', 1};  // an array of cells
  REQUIRE(places(name).size() == 1);
  const std::size_t type = places(name)[0] + name.size();
  for (const std::int32_t other : {-1, 10, 2147483647}) refuses(type, other);
  for (const std::int32_t other : {-1, 0, 17}) refuses(type + 4, other);
  REQUIRE(places(std::uint64_t{7}).size() == 1);  // the particles' number
  for (const std::uint64_t other : {std::uint64_t{1} << 20, ~std::uint64_t{0}})
    refuses(places(std::uint64_t{7})[0], other);
}

TEST_CASE("arrays keep the order in which they were first set") {
  Fields fields;
  fields.setBlocks({});
  const auto namesInOrder = [&] {
    std::vector<std::string> names;
    for (const Fields::NamedArray& array : fields.arrays()) names.push_back(array.name);
    return names;
  };
  for (const char* name : {"V", "A", "V"}) {
    const std::uint64_t before = fields.changes();
    fields.set(fields.arrayChange(name, true, VDI_CATALYST_F32, {}));
    CHECK(fields.changes() != before);
  }
  CHECK(namesInOrder() == std::vector<std::string>{"V", "A"});
  // Particles take the array's place, and their array comes when it is made.
  vdi_catalyst_particles given{};
  fields.set(fields.particlesChange("V", particleArrayOf(&given)));
  CHECK(namesInOrder() == std::vector<std::string>{"A"});
  fields.setDeposit("V", {});
  CHECK(namesInOrder() == std::vector<std::string>{"A", "V"});
  fields.setBlocks({});
  CHECK(namesInOrder().empty());
}
