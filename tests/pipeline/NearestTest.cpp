// Nearest values: device, reference and VDIs compared with the optical model in double precision, and labels
// that no voxel has and no picture may show.
#include <cmath>
#include <vector>

#include "tests/Catch.h"
#include "tests/OpticalScenes.h"
#include "tests/Scenes.h"
#include "tests/pipeline/AgainstReference.h"
#include "vdi/core/Flatten.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vdi/reference/Reference.h"

using namespace vdi;
using synthetic::Joint;

namespace {

/// Layers of labels 0, 1, 3 and 4, so that 1 and 3 touch, as well as 0 and 4.
double labelAt(const glm::dvec3& p) {
  constexpr double labels[] = {0.0, 1.0, 3.0, 1.0, 4.0, 0.0};
  return labels[static_cast<std::size_t>(6.0 * std::min(test::waves(p), 0.999))];
}

/// A colour per label, by steps at half-integers. Only label 2 is green, and label 0 is clear.
TransferFunction functionOfLabels() {
  TransferFunction function;
  function.unitDistance = 0.3;
  const glm::dvec3 colors[] = {{1, 0, 1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.7, 0, 0.3}};
  constexpr double opacities[] = {0.0, 0.5, 0.9, 0.3, 0.8};
  for (int label = 0; label < 5; ++label) {
    for (const double x : {label - 0.5, label + 0.5}) {
      function.colors.push_back({x, colors[label]});
      function.opacities.push_back({x, opacities[label]});
    }
  }
  return function;
}

/// A lattice of labels whose longest side is 1, in blocks; the whole one for the exact reference.
struct Labels {
  std::vector<Block> blocks;
  reference::ExactVolume whole;
};

Labels labelsOf(ScalarType type, Joint joint, const glm::ivec3& blocks) {
  const glm::ivec3 size{13, 11, 12};
  const bool cells = joint == Joint::Cells;
  const double spacing = 1.0 / (13 - (cells ? 0 : 1));
  const auto valueAt = [&](const glm::ivec3& index) {
    return labelAt((glm::dvec3(index) + (cells ? 0.5 : 0.0)) * spacing);
  };
  const synthetic::Lattice lattice{size, glm::dvec3(0.0), glm::dvec3(spacing), type, joint};
  Labels labels;
  for (const synthetic::Part& part :
       synthetic::decompose(size, blocks, synthetic::Layout::OnOneRank, joint, 1, 3))
    labels.blocks.push_back(synthetic::makeBlock(lattice, part, valueAt));
  labels.whole = test::wholeOf(size, spacing, cells, valueAt);
  labels.whole.nearest = true;
  return labels;
}

GenerateSettings nearestSettings(int width, int height, double rate) {
  GenerateSettings settings = test::smallSettings(width, height, 24);
  settings.interpolation = Interpolation::Nearest;
  settings.samplesPerVoxel = rate;
  return settings;
}

}  // namespace

TEST_CASE("nearest: the optical model's integral at any rate, and no label that no voxel has", "[pictures]") {
  const TransferFunction function = functionOfLabels();
  VdiGenerator generator(test::device(), comm::Communicator::serial());
  struct Case {
    ScalarType type;
    Joint joint;
    bool parallel;
    glm::ivec3 blocks;
  };
  const Case cases[] = {{ScalarType::U8, Joint::Cells, false, {1, 1, 1}},
                        {ScalarType::I32, Joint::SharedPoints, true, {2, 2, 2}}};
  for (const Case& c : cases) {
    const Labels labels = labelsOf(c.type, c.joint, c.blocks);
    const Camera camera = test::lookingAt(c.parallel);
    generator.setBlocks(labels.blocks);
    const Image expected = reference::renderExactly(labels.whole, function, camera, 20, 16, 200);
    REQUIRE(test::mostOpaque(expected) > 0.8F);
    for (const double rate : {automaticRate, 1.0, 0.3}) {
      INFO(toString(c.type) << ", rate " << rate);
      const GenerateSettings settings = nearestSettings(20, 16, rate);
      const Image picture = *generator.renderVolume(camera, function, settings);
      const Image flat = flatten(*generator.generate(camera, function, settings));
      CHECK(test::brightest(picture).g == 0.0F);
      CHECK(test::brightest(flat).g == 0.0F);
      if (rate == 0.3) continue;  // samples of a middle, as in ParaView
      const test::Off off = test::offBetween(picture, expected);
      CHECK(off.largest < 2.0);
      CHECK(off.mean < 0.3);
      CHECK(test::offBetween(flat, expected).largest < 2.5);
    }
    // What the linear picture shows between labels.
    GenerateSettings linear = nearestSettings(20, 16, 1.0);
    linear.interpolation = Interpolation::Linear;
    CHECK(test::brightest(*generator.renderVolume(camera, function, linear)).g > 0.1F);
  }
}

TEST_CASE("nearest: DVR and lists of the device are the reference's, shaded too", "[pictures]") {
  const TransferFunction function = functionOfLabels();
  for (const bool shade : {false, true}) {
    VdiGenerator generator(shade ? test::device() : test::deviceAsGpu(), comm::Communicator::serial());
    const Labels labels = labelsOf(shade ? ScalarType::U16 : ScalarType::F64,
                                   shade ? Joint::Cells : Joint::SharedPoints, {2, 2, 1});
    GenerateSettings settings = nearestSettings(31, 23, 1.0);
    settings.precision = Precision::Full;
    settings.shading.on = shade;
    const Camera camera = test::lookingAt(false);
    generator.setBlocks(labels.blocks);
    const reference::RayInputs inputs(generator.scene(), camera, function, settings);
    const Image expected = reference::renderVolume(inputs, test::withLayers(labels.blocks));
    CHECK(test::largestDifference(*generator.renderVolume(camera, function, settings), expected) < 1.5F);
    CHECK(test::largestDifference(flatten(*generator.generate(camera, function, settings)), expected) < 1.5F);
  }
}

TEST_CASE("nearest: blocks of several levels mix no labels") {
  // Cells or points; the finer block has half of the domain's spacing, or a third of it.
  VdiGenerator generator(test::device(), comm::Communicator::serial());
  const TransferFunction function = functionOfLabels();
  const Camera camera = test::lookingAt(false);
  for (const Joint joint : {Joint::Cells, Joint::SharedPoints}) {
    for (const int ratio : {2, 3}) {
      const int points = joint == Joint::Cells ? 0 : 1;
      std::vector<Block> blocks;
      for (const bool fine : {false, true}) {
        const double spacing = fine ? 0.1 / ratio : 0.1;
        const glm::ivec3 size = (fine ? glm::ivec3(5 * ratio) : glm::ivec3(10)) + points;
        const glm::dvec3 corner = fine ? glm::dvec3(0.5, 0.3, 0.4) : glm::dvec3(0.0);
        const synthetic::Lattice lattice{size, corner, glm::dvec3(spacing), ScalarType::U8, joint};
        Block block = synthetic::makeBlock(lattice, {glm::ivec3(0), size, 0}, [&](const glm::ivec3& index) {
          return labelAt(corner + (glm::dvec3(index) + (points == 0 ? 0.5 : 0.0)) * spacing);
        });
        block.nearest = true;
        blocks.push_back(block);
      }
      generator.setBlocks(blocks);
      for (const double rate : {1.0, 0.6}) {
        const Image picture = *generator.renderVolume(camera, function, nearestSettings(48, 40, rate));
        CHECK(test::mostOpaque(picture) > 0.8F);
        CHECK(test::brightest(picture).g == 0.0F);
      }
    }
  }
}
