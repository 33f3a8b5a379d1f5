// Blocks of many numbers, sizes and layouts in memory.
#include <algorithm>
#include <cstdint>
#include <vector>

#include "tests/pipeline/AgainstReference.h"
#include "vdi/comm/Communicator.h"
#include "vdi/pipeline/VdiGenerator.h"

using namespace vdi;
using synthetic::Joint;
using test::device;
using test::largestDifference;

TEST_CASE(
    "values that are copied unchanged and values that are staged, several buffers full, give one picture") {
  // Both give equal texels: those of i16 are shifted up.
  const glm::ivec3 size{262, 261, 260};
  std::vector<std::uint16_t> values;
  values.reserve(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y) *
                 static_cast<std::size_t>(size.z));
  for (int z = 0; z < size.z; ++z) {
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; ++x)
        values.push_back(static_cast<std::uint16_t>(200 * ((x / 16 + y / 16 + z / 16) % 7) + z));
    }
  }
  std::vector<std::int16_t> shifted;
  shifted.reserve(values.size());
  for (const std::uint16_t value : values) shifted.push_back(static_cast<std::int16_t>(value - 32768));
  const auto pictureOf = [&](ScalarType type, const void* data, double offset) {
    Block block;
    block.dims = size;
    block.origin = glm::dvec3(0.0);
    block.spacing = glm::dvec3(1.0 / 261);
    block.type = type;
    block.data = data;
    block.owned = {glm::dvec3(0.0), glm::dvec3(size - 1) / 261.0};
    TransferFunction function = test::threeHues(1400.0);
    for (auto& node : function.colors) node.x += offset;
    for (auto& node : function.opacities) node.x += offset;
    VdiGenerator generator(device(), comm::Communicator::serial());
    generator.setBlocks({block});
    return *generator.renderVolume(test::oblique(), function, test::smallSettings(48, 36));
  };
  const Image direct = pictureOf(ScalarType::U16, values.data(), 0.0);
  const Image staged = pictureOf(ScalarType::I16, shifted.data(), -32768.0);
  CHECK(std::any_of(direct.rgba.begin(), direct.rgba.end(), [](const glm::vec4& c) { return c.a > 0.5F; }));
  CHECK(largestDifference(direct, staged) < 0.01F);
  CHECK(device()->validationMessages() == "");
}

TEST_CASE("thousands of small blocks in one pass") {
  const auto decomposed = test::onOneRank("turbulence", {61, 61, 61}, {15, 15, 15}, ScalarType::U8);
  CHECK(decomposed.mine.size() == 3375);
  const auto whole = test::onOneRank("turbulence", {61, 61, 61}, {1, 1, 1}, ScalarType::U8);
  const TransferFunction function = test::threeHues(80.0);
  const GenerateSettings settings = test::smallSettings();
  VdiGenerator many(device(), comm::Communicator::serial());
  VdiGenerator one(device(), comm::Communicator::serial());
  many.setBlocks(decomposed.mine);
  one.setBlocks(whole.mine);
  const auto image = many.renderVolume(test::oblique(), function, settings);
  CHECK(largestDifference(*image, *one.renderVolume(test::oblique(), function, settings)) < 1.0F);
}

TEST_CASE("a block cut to fit the device's images shows no seam") {
  const auto whole = test::onOneRank("turbulence", {40, 40, 40});
  // A steep function, so that samples beside a cut depend on the values beyond it.
  TransferFunction function = test::threeHues(1.0);
  function.opacities = {{0.0, 0.0}, {0.5, 0.0}, {0.52, 1.0}, {0.54, 0.0}, {1.0, 0.0}};
  const GenerateSettings settings = test::smallSettings();
  gpu::DeviceRequest request = gpu::requestFromEnvironment(0);
  request.maxImageDimension3D = 24;
  VdiGenerator cut(gpu::Device::create(request), comm::Communicator::serial());
  VdiGenerator one(device(), comm::Communicator::serial());
  cut.setBlocks(whole.mine);
  one.setBlocks(whole.mine);
  const auto image = cut.renderVolume(test::oblique(), function, settings);
  CHECK(largestDifference(*image, *one.renderVolume(test::oblique(), function, settings)) < 1.0F);
}

TEST_CASE("blocks of different spacing side by side") {
  // The upper half has twice the resolution.
  const synthetic::Field ramp = synthetic::makeField("ramp", 0);
  const auto make = [&](const glm::ivec3& dims, double z, double spacing) {
    const synthetic::Lattice lattice{
        dims, {0.0, 0.0, z}, glm::dvec3(spacing), ScalarType::F32, Joint::SharedPoints};
    return synthetic::makeBlock(lattice, {{0, 0, 0}, dims, 0}, [&, lattice](const glm::ivec3& i) {
      return ramp(lattice.origin + glm::dvec3(i) * spacing);
    });
  };
  const Block coarse = make({11, 11, 6}, 0.0, 0.1);
  const Block fine = make({21, 21, 11}, 0.5, 0.05);
  const Block all = make({21, 21, 21}, 0.0, 0.05);
  const TransferFunction function = test::threeHues(0.9);
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks({coarse, fine});
  const auto image = generator.renderVolume(test::oblique(), function, test::smallSettings());
  generator.setBlocks({all});
  CHECK(largestDifference(*image, *generator.renderVolume(test::oblique(), function, test::smallSettings())) <
        1.0F);
}
