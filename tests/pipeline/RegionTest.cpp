// Cropping and clipping: the device compared with the reference, with a volume of the remaining values, and
// with an integral that shares nothing with them.
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "tests/Catch.h"
#include "tests/Devices.h"
#include "tests/OpticalScenes.h"
#include "tests/Scenes.h"
#include "tests/pipeline/Integral.h"
#include "tests/pipeline/PictureDifference.h"
#include "vdi/comm/GhostExchange.h"
#include "vdi/core/Error.h"
#include "vdi/core/Flatten.h"
#include "vdi/core/SettingsTable.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vdi/reference/Reference.h"

using namespace vdi;

namespace {

Region boxAndPlanes() {
  Region region;
  region.box = Box{{0.13, -5.0, 0.21}, {0.9, 0.77, 7.0}};
  region.planes = {{{0.5, 0.5, 0.7}, {0.3, -0.4, -2.0}}, {{0.2, 0.0, 0.0}, {1.0, 0.2, 0.1}}};
  return region;
}

}  // namespace

TEST_CASE("region: DVR and lists of the device are the reference's", "[pictures]") {
  for (const auto& [device, parallel] : {std::pair(test::device(), false), std::pair(test::device(), true),
                                         std::pair(test::device(true), true)}) {
    VdiGenerator generator(device, comm::Communicator::serial());
    const auto decomposed = test::onOneRank("turbulence", {26, 22, 24}, {2, 2, 2});
    const TransferFunction function = test::threeHues(0.8);
    GenerateSettings settings = test::smallSettings(31, 23, 8);
    settings.precision = Precision::Full;
    settings.region = boxAndPlanes();
    settings.shading.on = parallel;
    settings.samplesPerVoxel = parallel ? 0.4 : 1.0;
    const Camera camera = test::oblique(parallel);
    generator.setBlocks(decomposed.mine);
    const reference::RayInputs inputs(generator.scene(), camera, function, settings);
    const Image expected =
        reference::renderVolume(inputs, comm::exchangeGhosts(comm::Communicator::serial(), decomposed.mine));
    const auto image = generator.renderVolume(camera, function, settings);
    CHECK(test::largestDifference(*image, expected) < (device->isCpu() ? 0.5F : 1.5F));  // coarse filters
    const auto vdi = generator.generate(camera, function, settings);
    CHECK_NOTHROW(validate(*vdi));
    CHECK(test::largestDifference(flatten(*vdi), expected) < 1.5F);
    CHECK(vdi->bounds == generator.scene().bounds.intersection(*settings.region.box));
  }
}

TEST_CASE("region: a box on the lattice shows the volume of the values in it") {
  const glm::ivec3 size(24, 20, 22);
  const auto value = [](const glm::dvec3& p) {
    return 0.5 + 0.5 * std::sin(0.6 * p.x + std::sin(0.4 * p.y)) * std::cos(0.5 * p.z);
  };
  const glm::ivec3 first(5, 0, 7);
  const glm::ivec3 last(17, 14, 21);
  const test::Lattice whole(size, glm::dvec3(1.0), value);
  const test::Lattice part(last - first + 1, glm::dvec3(1.0),
                           [&](const glm::dvec3& p) { return value(p + glm::dvec3(first)); });
  Block cut = part.block(ScalarType::F32, 1.0);
  cut.origin = first;
  cut.owned = {glm::dvec3(first), glm::dvec3(last)};
  TransferFunction function = test::threeHues(1.0, 3.0);
  GenerateSettings settings = test::smallSettings(40, 32);
  VdiGenerator generator(test::device(), comm::Communicator::serial());
  settings.samplesPerVoxel = 4.0;  // the samples of the two begin at different depths
  for (const glm::dvec3 direction :
       {glm::dvec3(0.0, 0.0, -1.0), glm::dvec3(-0.6, -0.4, -1.0), glm::dvec3(1.0, 0.3, 0.2)}) {
    const Camera camera =
        Camera::framing({glm::dvec3(0.0), glm::dvec3(size - 1)}, direction, {0.0, 1.0, 0.0});
    generator.setBlocks({cut});
    const auto expected = generator.renderVolume(camera, function, settings);
    generator.setBlocks({whole.block(ScalarType::F32, 1.0)});
    settings.region = {};
    const auto all = generator.renderVolume(camera, function, settings);
    settings.region.box = cut.owned;
    const auto cropped = generator.renderVolume(camera, function, settings);
    CHECK(test::largestDifference(*cropped, *expected) < 2.0F);
    CHECK(test::largestDifference(*all, *expected) > 60.0F);
    // Six planes give the same as the box.
    settings.region = {};
    for (int axis = 0; axis < 3; ++axis) {
      glm::dvec3 normal(0.0);
      normal[axis] = 1.0;
      settings.region.planes.push_back({glm::dvec3(first), normal});
      settings.region.planes.push_back({glm::dvec3(last), -normal});
    }
    const auto clipped = generator.renderVolume(camera, function, settings);
    CHECK(test::largestDifference(*clipped, *cropped) < 1.0F);
    settings.region = {};
  }
}

TEST_CASE("region: the blocks don't show, however far the outermost samples reach", "[pictures]") {
  // The region ends shortly behind a face between blocks, where a ray's last sample reaches farther than the
  // block in front has values.
  const glm::ivec3 size{17, 17, 17};
  const auto whole = test::onOneRank("turbulence", size);
  const auto many = test::onOneRank("turbulence", size, {2, 2, 2});
  VdiGenerator generator(test::device(), comm::Communicator::serial());
  generator.setBlocks(whole.mine);
  const Box bounds = generator.scene().bounds;
  TransferFunction function = test::threeHues(1.0, 0.1);
  GenerateSettings settings = test::smallSettings(40, 24);
  for (const double rate : {0.56, 0.6, 1.0}) {
    Camera camera = Camera::framing(bounds, {0.1, 0.05, -1.0}, {0.0, 1.0, 0.0});
    if (rate == 1.0) {  // rays far from the axis take long steps
      camera.viewAngle = 100.0;
      camera.position = camera.focalPoint + (camera.position - camera.focalPoint) * 0.4;
    }
    settings.samplesPerVoxel = rate;
    settings.region.box = bounds;
    for (const double end : {0.54, 0.58, 0.61}) {
      settings.region.box->lo.z = bounds.lo.z + (1.0 - end) * (bounds.hi.z - bounds.lo.z);
      generator.setBlocks(whole.mine);
      const auto expected = generator.renderVolume(camera, function, settings);
      generator.setBlocks(many.mine);
      INFO("rate " << rate << ", the nearest " << end);
      CHECK(test::mostOpaque(*expected) > 0.5F);
      CHECK(test::largestDifference(*generator.renderVolume(camera, function, settings), *expected) < 1.0F);
      const reference::RayInputs inputs(generator.scene(), camera, function, settings);
      CHECK(test::largestDifference(reference::renderVolume(inputs, whole.mine), *expected) < 0.5F);
    }
  }
}

TEST_CASE("region: the optical model's integral, with light at the cut", "[pictures]") {
  const glm::ivec3 size{22, 24, 16};
  const glm::dvec3 spacing{1.0, 0.8, 1.5};
  const test::Lattice lattice(size, spacing, [&](const glm::dvec3& p) {
    const double r = glm::length((p - glm::dvec3(30.0, -4.0, 8.0)) / glm::dvec3(24.0, 20.0, 30.0));
    return std::clamp(1.5 - r + 0.06 * std::sin(0.7 * p.x) * std::cos(0.5 * p.y), 0.0, 1.0);
  });
  const test::Material material{{0.1, 0.5, 0.0}, {1.0, 0.0, 0.4}, 0.4, 0.6, 2.0};
  const ClipPlane plane{{9.0, 9.0, 12.3}, {0.2, 0.5, -1.0}};
  const Box box{{3.3, 2.1, 2.2}, {18.9, 16.0, 21.0}};
  const test::Look look{{{{0.0, 0.0, 1.0}, {1.0, 1.0, 1.0}}}, 0.0, [&](const glm::dvec3& p) {
                          return p.x >= 3.3 && p.x < 18.9 && p.y >= 2.1 && p.y < 16.0 && p.z >= 2.2 &&
                                 0.2 * (p.x - 9.0) + 0.5 * (p.y - 9.0) - (p.z - 12.3) >= 0.0;
                        }};
  Camera camera;
  camera.focalPoint = 0.5 * glm::dvec3(size - 1) * spacing;
  camera.position = camera.focalPoint + glm::dvec3(0.0, 0.0, 100.0);
  camera.parallelProjection = true;
  camera.parallelScale = 12.0;
  GenerateSettings settings = test::smallSettings(28, 24, 20);
  settings.shading = {.on = true, .ambient = 0.0, .diffuse = 1.0, .lights = {Light{}}};
  settings.region.box = box;
  settings.region.planes = {plane};
  VdiGenerator generator(test::device(), comm::Communicator::serial());
  generator.setBlocks({lattice.block(ScalarType::F32, 1.0)});
  const Image flat = flatten(*generator.generate(camera, material.function(1.0), settings));
  double worst = 0.0;
  double densest = 0.0;
  for (int y = 0; y < settings.height; ++y) {
    for (int x = 0; x < settings.width; ++x) {
      const double perPixel = 2.0 * camera.parallelScale / settings.height;
      const auto expected = test::integral(
          lattice, material, look, camera.focalPoint.x + (x + 0.5 - 0.5 * settings.width) * perPixel,
          camera.focalPoint.y + (y + 0.5 - 0.5 * settings.height) * perPixel);
      for (int channel = 0; channel < 4; ++channel) {
        const double seen = flat.rgba[static_cast<std::size_t>(y * settings.width + x)][channel];
        worst = std::max(worst, std::abs(seen - expected[static_cast<std::size_t>(channel)]));
      }
      densest = std::max(densest, expected[3]);
    }
  }
  CHECK(densest > 0.9);
  CHECK(255.0 * worst < 5.0);
}

TEST_CASE("region: an empty rest, and refusals by name") {
  const auto decomposed = test::onOneRank("turbulence", {12, 12, 12});
  VdiGenerator generator(test::device(), comm::Communicator::serial());
  generator.setBlocks(decomposed.mine);
  Region beside;
  beside.box = Box{glm::dvec3(2.0), glm::dvec3(3.0)};
  Region behind;
  behind.planes = {{glm::dvec3(0.4), {0.0, 0.0, 1.0}}, {glm::dvec3(0.3), {0.0, 0.0, -1.0}}};
  for (const Region& region : {beside, behind}) {
    GenerateSettings settings = test::smallSettings(16, 12);
    settings.region = region;
    const auto image = generator.renderVolume(test::oblique(), test::threeHues(0.8), settings);
    for (const glm::vec4& pixel : image->rgba) CHECK(pixel == glm::vec4(0.0F));
    const auto vdi = generator.generate(test::oblique(), test::threeHues(0.8), settings);
    CHECK(vdi->supersegmentCount() == 0);
    CHECK_NOTHROW(validate(*vdi));
  }
  const auto refused = [](const Region& region, const std::string& what) {
    GenerateSettings settings;
    settings.region = region;
    CHECK_THROWS_WITH(validate(settings), vdi::test::ContainsSubstring(what));
  };
  Region wrong;
  wrong.box = Box{glm::dvec3(1.0), glm::dvec3(1.0)};
  refused(wrong, "cropping box");
  wrong = {};
  wrong.planes.resize(7);
  refused(wrong, "6 planes");
  wrong.planes = {{glm::dvec3(0.0), glm::dvec3(0.0)}};
  refused(wrong, "normal");
}
