// Components together: red, green, blue and opacity, or colour and opacity, as values of the data. Device and
// reference are compared with the optical model in double precision.
#include <cmath>
#include <cstring>
#include <vector>

#include "tests/Catch.h"
#include "tests/OpticalScenes.h"
#include "tests/Scenes.h"
#include "tests/pipeline/AgainstReference.h"
#include "vdi/core/ComponentValues.h"
#include "vdi/core/Flatten.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vdi/reference/Reference.h"

using namespace vdi;
using synthetic::Joint;

namespace {

/// Opacity's scalar is the last component.
double componentAt(int component, bool isLast, const glm::dvec3& p) {
  if (isLast) return test::waves(p);
  const double phases[] = {0.0, 2.0, 4.0};
  return 0.5 + 0.5 * std::sin(5.0 * p.x + 3.0 * p.y - 4.0 * p.z + phases[component]);
}

/// An interleaved array of components on a lattice whose longest side is 1, in blocks that read it; and the
/// volumes of the exact reference, with values in [0, 1].
struct Components {
  std::vector<std::vector<std::byte>> arrays;  // one per block
  std::vector<Block> blocks;
  reference::ExactVolume whole;
};

Components componentsOf(ScalarType type, int count, const glm::ivec3& parts, double top, bool nearest) {
  const glm::ivec3 size{13, 11, 12};
  const double spacing = 1.0 / 12.0;
  const auto valueAt = [&](int c, const glm::ivec3& index) {
    const double value = top * componentAt(c, c == count - 1, glm::dvec3(index) * spacing);
    return type == ScalarType::F32 || type == ScalarType::F64 ? value : std::round(value);
  };
  Components made;
  for (const synthetic::Part& part :
       synthetic::decompose(size, parts, synthetic::Layout::OnOneRank, Joint::SharedPoints, 1, 3)) {
    std::vector<std::byte> array;
    for (int z = 0; z < part.dims.z; ++z) {
      for (int y = 0; y < part.dims.y; ++y) {
        for (int x = 0; x < part.dims.x; ++x) {
          for (int c = 0; c < count; ++c) {
            array.resize(array.size() + sizeOf(type));
            storeValue(type, array.data(), array.size() / sizeOf(type) - 1,
                       valueAt(c, part.first + glm::ivec3(x, y, z)));
          }
        }
      }
    }
    Block block = Block::fromPoints(part.dims, glm::dvec3(part.first) * spacing, glm::dvec3(spacing),
                                    ScalarType::U8, array.data());
    const auto bytes = static_cast<std::int64_t>(sizeOf(type));
    showComponent(block,
                  {array.data(), packedStrides(part.dims, sizeOf(type)) * std::int64_t{count},
                   static_cast<ComponentType>(type), count, bytes},
                  together);
    made.blocks.push_back(std::move(block));
    made.arrays.push_back(std::move(array));  // its memory stays where it is
  }
  const auto volumeOf = [&](int c) {
    reference::ExactVolume volume{
        size, glm::dvec3(0.0), glm::dvec3(spacing), {glm::dvec3(0.0), glm::dvec3(size - 1) * spacing},
        {},   nearest};
    for (int z = 0; z < size.z; ++z) {
      for (int y = 0; y < size.y; ++y) {
        for (int x = 0; x < size.x; ++x) volume.values.push_back(valueAt(c, {x, y, z}) / top);
      }
    }
    return volume;
  };
  made.whole = volumeOf(count - 1);
  for (int c = 0; c + 1 < count; ++c) made.whole.colors.push_back(volumeOf(c));
  return made;
}

/// Nodes over [0, top].
TransferFunction functionUpTo(double top) {
  TransferFunction function = test::threeHues(top, 0.2);
  function.opacities = {{0.0, 0.0}, {0.2 * top, 0.02}, {0.7 * top, 0.5}, {top, 0.9}};
  return function;
}

}  // namespace

TEST_CASE("components: the optical model's integral of the data's colours and opacities", "[pictures]") {
  struct Case {
    ScalarType type;
    int components;
    double top;
    glm::ivec3 blocks;
    Interpolation interpolation;
    bool shade;
  };
  const Case cases[] = {
      {ScalarType::U8, 4, 255.0, {1, 1, 1}, Interpolation::Linear, false},
      {ScalarType::F32, 4, 1.0, {2, 2, 2}, Interpolation::Nearest, false},
      {ScalarType::U16, 2, 60000.0, {2, 1, 2}, Interpolation::Linear, true},
      {ScalarType::F64, 2, 1000.0, {1, 2, 1}, Interpolation::Linear, false},
  };
  const Camera camera = test::lookingAt(false);
  for (const Case& c : cases) {
    INFO(toString(c.type) << ", " << c.components << " components");
    const Components made =
        componentsOf(c.type, c.components, c.blocks, c.top, c.interpolation == Interpolation::Nearest);
    VdiGenerator generator(c.shade ? test::deviceAsGpu() : test::device(), comm::Communicator::serial());
    generator.setBlocks(made.blocks);
    const TransferFunction function = functionUpTo(c.top);
    GenerateSettings settings = test::smallSettings(20, 16, 24);
    settings.samplesPerVoxel = 2.0;
    settings.interpolation = c.interpolation;
    settings.shading.on = c.shade;
    const reference::RayInputs inputs(generator.scene(), camera, function, settings);
    std::vector<Block> blocks = test::withLayers(made.blocks);
    for (std::size_t color = 0; color + 1 < static_cast<std::size_t>(c.components); ++color) {
      std::vector<Block> values;
      for (const Block& block : made.blocks) values.push_back(block.withColors(color));
      values = test::withLayers(values);
      for (std::size_t i = 0; i < blocks.size(); ++i) blocks[i].colors[color] = values[i];
    }
    const Image byReference = reference::renderVolume(inputs, blocks);
    const Image picture = *generator.renderVolume(camera, function, settings);
    const Image flat = flatten(*generator.generate(camera, function, settings));
    CHECK(test::largestDifference(picture, byReference) < 1.5F);
    CHECK(test::largestDifference(flat, byReference) < 2.5F);
    if (c.shade) continue;
    const Image expected = reference::renderExactly(made.whole, functionUpTo(1.0), camera, 20, 16, 100);
    REQUIRE(test::mostOpaque(expected) > 0.8F);
    const test::Off off = test::offBetween(picture, expected);
    CHECK(off.largest < 2.0);
    CHECK(off.mean < 0.5);
  }
}

TEST_CASE("components: what doesn't go together is refused") {
  CHECK(componentIssue(together, 2).empty());
  CHECK(componentIssue(together, 4).empty());
  for (const int count : {1, 3, 5})
    CHECK_THAT(componentIssue(together, count), test::ContainsSubstring("two, colour and opacity, or four"));
  CHECK_THAT(componentIssue(phase, 3), test::ContainsSubstring("real and imaginary"));
  CHECK_THAT(componentIssue(4, 4), test::ContainsSubstring("doesn't exist"));
  const Components four = componentsOf(ScalarType::U8, 4, {1, 1, 1}, 255.0, false);
  const Components two = componentsOf(ScalarType::U8, 2, {2, 1, 1}, 255.0, false);
  VdiGenerator generator(test::device(), comm::Communicator::serial());
  CHECK_THROWS_WITH(generator.setBlocks({four.blocks[0], two.blocks[1]}),
                    test::ContainsSubstring("same components"));
  generator.setBlocks(four.blocks);
  GenerateSettings settings = test::smallSettings(8, 8);
  settings.blending.mode = BlendMode::Maximum;
  CHECK_THROWS_WITH(generator.renderVolume(test::lookingAt(false), functionUpTo(255.0), settings),
                    test::ContainsSubstring("single component"));
}
