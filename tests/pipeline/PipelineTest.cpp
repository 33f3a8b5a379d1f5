// Generation on the device compared with the reference, and a VDI compared with DVR.
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "tests/pipeline/AgainstReference.h"
#include "vdi/comm/Communicator.h"
#include "vdi/core/Flatten.h"
#include "vdi/core/ImageMetrics.h"
#include "vdi/core/Margin.h"
#include "vdi/io/Png.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vdi/pipeline/VdiRenderer.h"
#include "vdi/reference/Compaction.h"
#include "vdi/reference/Reference.h"

using namespace vdi;
using synthetic::Joint;
using synthetic::Layout;
using test::algorithms;
using test::byFilter;
using test::depthsThatDiffer;
using test::device;
using test::deviceAsGpu;
using test::isView;
using test::largestDifference;
using test::listsThatDiffer;
using test::oneCode;
using test::rounding;
using test::withLayers;

TEST_CASE("DVR, generation and rendering on the device equal the reference", "[pictures]") {
  for (const bool parallel : {false, true}) {
    for (const ScalarType type : {ScalarType::U8, ScalarType::I8, ScalarType::U16, ScalarType::I16,
                                  ScalarType::U32, ScalarType::I32, ScalarType::F32, ScalarType::F64}) {
      if (parallel && type != ScalarType::F32) continue;
      INFO(toString(type) << (parallel ? ", parallel" : ", perspective"));
      const auto decomposed = test::onOneRank("turbulence", {26, 22, 24}, {2, 2, 2}, type);
      const TransferFunction function = test::threeHues(test::topOf(type) * 0.8);
      // Odd sizes: the last row and column lie beyond the last counted ones.
      const GenerateSettings settings = test::smallSettings(47, 35, 8);
      const Camera camera = test::oblique(parallel);
      VdiGenerator generator(device(), comm::Communicator::serial());
      generator.setBlocks(decomposed.mine);
      ScalarRange range;
      for (const Block& block : decomposed.mine) range.include(ownRange(block));
      CHECK(generator.scalarRange() == range);
      const reference::RayInputs inputs(generator.scene(), camera, function, settings);

      const auto image = generator.renderVolume(camera, function, settings);
      const Image expected = reference::renderVolume(inputs, withLayers(decomposed.mine));
      CHECK(largestDifference(*image, expected) < 0.5F);
      CHECK(depthsThatDiffer(*image, expected, 1e-3F) <= image->depth.size() / 100);

      std::optional<Vdi> vdi;
      for (const Algorithm algorithm : algorithms) {
        INFO(toString(algorithm));
        GenerateSettings own = settings;
        own.algorithm = algorithm;
        const reference::RayInputs ownInputs(generator.scene(), camera, function, own);
        const SupersegmentLists lists = reference::generate(ownInputs, withLayers(decomposed.mine), false);
        CHECK(lists.segments.size() > lists.listCount());
        own.precision = Precision::Full;
        const auto full = generator.generate(camera, function, own);
        CHECK_NOTHROW(validate(*full));
        own.precision = Precision::Compact;
        vdi = generator.generate(camera, function, own);
        CHECK_NOTHROW(validate(*vdi));
        CHECK(vdi->precision() == Precision::Compact);
        CHECK(listsThatDiffer(full->expandedLists(), lists) <=
              lists.listCount() / byFilter<std::size_t>(50, 20));
        CHECK(largestDifference(flatten(*full), expected) < 0.5F);
        // Codes of the very floats that the device made: rounding may change a few of them.
        const SupersegmentLists codes =
            expanded(reference::compacted(full->expandedLists(), vdi->depthCode), vdi->depthCode);
        CHECK(listsThatDiffer(vdi->expandedLists(), codes, oneCode) <= lists.listCount() / 50);
        CHECK(largestDifference(flatten(*vdi), expected) < 1.0F);
      }

      VdiRenderer renderer(device());
      renderer.setVdi(*vdi);
      for (const double angle : {0.0, 7.0, 35.0, 100.0, 180.0}) {
        INFO("from " << angle << " degrees");
        const Camera other = camera.azimuth(angle);
        for (const Reconstruction reconstruction : test::reconstructions) {
          INFO(toString(reconstruction));
          // At this size, no ray runs exactly between two lists, where either would be right.
          const Image seen = renderer.render(other, 40, 32, reconstruction);
          const Image expectedThere = reference::render(*vdi, View(other, 40, 32), reconstruction);
          CHECK(isView(seen, expectedThere, reconstruction));
        }
      }
    }
  }
  CHECK(device()->validationMessages() == "");
}

TEST_CASE("a margin: the reference's lists around the picture, and no cut edge when the view turns",
          "[pictures]") {
  for (const bool parallel : {false, true}) {
    INFO((parallel ? "parallel" : "perspective"));
    const auto decomposed = test::onOneRank("turbulence", {26, 22, 24}, {2, 2, 2});
    const TransferFunction function = test::threeHues(0.8);
    VdiGenerator generator(device(), comm::Communicator::serial());
    generator.setBlocks(decomposed.mine);
    Camera camera = test::oblique(parallel);  // zoomed in to a quarter of the width
    camera.viewAngle /= 4.0;
    camera.parallelScale /= 4.0;
    GenerateSettings settings = test::smallSettings(32, 24, 8);
    settings.precision = Precision::Full;
    const Vdi without = *generator.generate(camera, function, settings);
    CHECK(without.margin == glm::ivec2(0));
    settings.margin = 1.0;
    const Vdi vdi = *generator.generate(camera, function, settings);
    CHECK_NOTHROW(validate(vdi));
    CHECK(vdi.camera == camera);
    CHECK(vdi.margin == marginOf(generator.scene(), camera, settings));
    CHECK(vdi.margin.x > 16);
    CHECK(vdi.pictureSize() == glm::ivec2(32, 24));
    const reference::RayInputs inputs(generator.scene(), camera, function, settings);
    const SupersegmentLists lists = reference::generate(inputs, withLayers(decomposed.mine), false);
    CHECK(listsThatDiffer(vdi.expandedLists(), lists) <= lists.listCount() / byFilter<std::size_t>(50, 20));
    // The picture does not depend on the margin.
    const Image picture = *generator.renderVolume(camera, function, settings);
    CHECK(picture.width == 32);
    CHECK(largestDifference(flatten(vdi), picture) < 0.5F);
    VdiRenderer renderer(device());
    const auto missing = [&](const Vdi& shown, double degrees) {
      renderer.setVdi(shown);
      const Camera other = camera.azimuth(degrees);
      const Image truth = *generator.renderVolume(other, function, settings);
      const Image seen = renderer.render(other, 32, 24);
      const Image expected = reference::render(shown, View(other, 32, 24), defaultReconstruction);
      CHECK(isView(seen, expected, defaultReconstruction));
      std::size_t count = 0;
      for (std::size_t i = 0; i < seen.rgba.size(); ++i)
        count += truth.rgba[i].a > 2.0F / 255.0F && seen.rgba[i].a == 0.0F ? 1 : 0;
      return static_cast<double>(count) / static_cast<double>(seen.rgba.size());
    };
    CHECK(missing(without, 20.0) > 0.01);
    CHECK(missing(vdi, 20.0) < 0.002);
    CHECK(missing(vdi, -20.0) < 0.002);
  }
}

TEST_CASE("macrocells that rays pass and samples that are counted as one: as in the reference",
          "[pictures]") {
  // Each axis has several macrocells, most of them empty.
  const auto decomposed = test::onOneRank("coil", {70, 75, 66}, {1, 2, 1}, ScalarType::U8);
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks(decomposed.mine);
  GenerateSettings settings = test::smallSettings(41, 33, 6);
  settings.precision = Precision::Full;
  for (const double top : {80.0, 30.0, 200.0}) {  // with the last one, almost nothing is visible
    INFO(top);
    // The smaller the budget, the more samples count as one.
    settings.supersegments = top == 80.0 ? 6 : top == 30.0 ? 1 : 3;
    const TransferFunction function = test::threeHues(top);
    const reference::RayInputs inputs(generator.scene(), test::oblique(), function, settings);
    const Image expected = reference::renderVolume(inputs, withLayers(decomposed.mine));
    CHECK(largestDifference(*generator.renderVolume(test::oblique(), function, settings), expected) <
          byFilter(0.5F, 2.0F));
    for (const Algorithm algorithm : algorithms) {
      INFO(toString(algorithm));
      GenerateSettings own = settings;
      own.algorithm = algorithm;
      const reference::RayInputs ownInputs(generator.scene(), test::oblique(), function, own);
      const SupersegmentLists lists = reference::generate(ownInputs, withLayers(decomposed.mine), false);
      const auto vdi = generator.generate(test::oblique(), function, own);
      CHECK(listsThatDiffer(vdi->expandedLists(), lists) <= lists.listCount() / 50);
    }
  }
}

TEST_CASE("rays continue behind material of opacity 1, unless they must end") {
  const auto decomposed = test::onOneRank("shells", {32, 32, 32});
  TransferFunction function = test::threeHues(1.0);
  function.opacities = {{0.0, 0.0}, {0.5, 0.0}, {0.6, 1.0}, {1.0, 1.0}};
  GenerateSettings settings = test::smallSettings(40, 30, 12);
  settings.precision = Precision::Full;
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks(decomposed.mine);
  std::vector<std::size_t> counts;
  for (const double termination : {0.9999, 1.0}) {
    INFO(termination);
    settings.terminationOpacity = termination;
    const auto vdi = generator.generate(test::oblique(), function, settings);
    const reference::RayInputs inputs(generator.scene(), test::oblique(), function, settings);
    const SupersegmentLists expected = reference::generate(inputs, withLayers(decomposed.mine), false);
    CHECK(listsThatDiffer(vdi->expandedLists(), expected) <=
          expected.listCount() / byFilter<std::size_t>(50, 4));
    // A device reads values at the scene's faces up to 2/256 of a voxel inside (VolumeStore.cpp); opaque
    // material there shows the colour of exactly that place.
    CHECK(largestDifference(flatten(*vdi), reference::renderVolume(inputs, withLayers(decomposed.mine))) <
          byFilter(2.0F, 4.0F));
    counts.push_back(vdi->supersegmentCount());
  }
  CHECK(counts[1] > 2 * counts[0]);
}

TEST_CASE("programs for GPUs give the same lists as those for CPUs", "[long]") {
  const Budget budget = GENERATE(Budget::List, Budget::Total);
  const std::uint32_t supersegments = GENERATE(1U, 6U, 255U);
  INFO(supersegments << " supersegments, budget " << toString(budget));
  const auto decomposed = test::decompose("turbulence", {64, 64, 64}, {2, 2, 2}, Layout::Random,
                                          Joint::SharedPoints, ScalarType::F32, 0, 1);
  const TransferFunction function = test::threeHues(0.8);
  GenerateSettings settings = test::smallSettings(117, 91, supersegments);
  settings.precision = Precision::Full;
  settings.samplesPerVoxel = supersegments == 255 ? 16.0 : 2.0;
  settings.budget = budget;
  const auto made = [&](const std::shared_ptr<gpu::Device>& on) {
    VdiGenerator generator(on, comm::Communicator::serial());
    generator.setBlocks(decomposed.mine);
    return *generator.generate(test::oblique(), function, settings);
  };
  const Vdi expected = made(device());
  const Vdi vdi = made(deviceAsGpu());
  const auto& lists = std::get<SupersegmentLists>(expected.lists);
  CHECK(lists.segments.size() > lists.listCount() / 4);
  CHECK(listsThatDiffer(std::get<SupersegmentLists>(vdi.lists), lists) <= lists.listCount() / 1000);
  CHECK(deviceAsGpu()->validationMessages() == "");
}

TEST_CASE("a VDI equals DVR at V_O and stays close around it") {
  const auto decomposed = test::onOneRank("mixing", {48, 48, 48}, {2, 2, 2});
  const TransferFunction function = test::threeHues(1.0);
  const GenerateSettings settings = test::smallSettings(128, 96, 20);
  const Camera camera = test::oblique();
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks(decomposed.mine);
  const auto vdi = generator.generate(camera, function, settings);
  VdiRenderer renderer(device());
  renderer.setVdi(*vdi);
  const std::pair<double, double> minSsim[] = {{0.0, 0.995}, {5.0, 0.98}, {20.0, 0.96}, {50.0, 0.90}};
  for (const auto& [angle, minimum] : minSsim) {
    INFO(angle << " degrees");
    const Camera other = camera.azimuth(angle);
    const auto truth = generator.renderVolume(other, function, settings);
    const Image seen = renderer.render(other, 128, 96);
    const ImageDifference difference =
        compare(io::toPicture(seen).rgb, io::toPicture(*truth).rgb, seen.width, seen.height, 3);
    CHECK(difference.ssim >= minimum);
    if (angle == 0.0) CHECK(difference.meanError < 0.5);
  }
}
