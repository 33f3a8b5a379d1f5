// Shading: the device compared with the reference, and with an integral in double precision that shares no
// table, no lattice of samples and no helper with them.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <tuple>
#include <vector>

#include "tests/Catch.h"
#include "tests/Devices.h"
#include "tests/Scenes.h"
#include "tests/pipeline/Integral.h"
#include "tests/pipeline/PictureDifference.h"
#include "vdi/comm/GhostExchange.h"
#include "vdi/core/Flatten.h"
#include "vdi/core/SettingsTable.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vdi/reference/Reference.h"

using namespace vdi;
using synthetic::Joint;
using test::integral;
using test::Lamp;
using test::Lattice;
using test::Material;

namespace {

Shading headlight(double ambient = 0.0, double diffuse = 1.0) {
  return {.on = true, .ambient = ambient, .diffuse = diffuse, .lights = {Light{}}};
}

Shading kit() {
  return {.on = true};
}

}  // namespace

TEST_CASE("shading: DVR and lists of the device are the reference's", "[pictures]") {
  struct Case {
    bool asGpu;  // nearly all of the time goes into compiling a program for each case
    ScalarType type;
    Joint joint;
    bool parallel;
    Shading shading;
  };
  Shading turned = kit();
  turned.lights = {{{1.0, 2.0, 0.5}, {0.9, 0.2, 0.1}}, {{0.0, 0.0, 0.0}, {0.1, 0.2, 0.5}}};
  std::vector<Case> cases;
  cases.push_back({false, ScalarType::F32, Joint::SharedPoints, false, kit()});
  cases.push_back({true, ScalarType::U8, Joint::Cells, false, headlight(0.2, 0.7)});
  cases.push_back({false, ScalarType::F64, Joint::SharedPoints, true, turned});
  for (const Case& c : cases) {
    VdiGenerator generator(test::device(c.asGpu), comm::Communicator::serial());
    INFO(toString(c.type));
    const auto decomposed = test::onOneRank("turbulence", {26, 22, 24}, {2, 2, 2}, c.type, c.joint);
    const TransferFunction function = test::threeHues(test::topOf(c.type) * 0.8);
    GenerateSettings settings = test::smallSettings(31, 23, 8);
    settings.precision = Precision::Full;
    settings.shading = c.shading;
    const Camera camera = test::oblique(c.parallel);
    generator.setBlocks(decomposed.mine);
    const reference::RayInputs inputs(generator.scene(), camera, function, settings);
    const auto blocks = comm::exchangeGhosts(comm::Communicator::serial(), decomposed.mine);
    const Image expected = reference::renderVolume(inputs, blocks);
    const auto image = generator.renderVolume(camera, function, settings);
    CHECK(test::largestDifference(*image, expected) < 1.5F);
    const auto vdi = generator.generate(camera, function, settings);
    CHECK(test::largestDifference(flatten(*vdi), expected) < 1.5F);
    // The picture differs from the unshaded one.
    GenerateSettings plain = settings;
    plain.shading.on = false;
    const auto unlit = generator.renderVolume(camera, function, plain);
    CHECK(test::largestDifference(*unlit, expected) > 30.0F);
  }
}

TEST_CASE("shading: the optical model's integral, per channel", "[pictures]") {
  // Anisotropic voxels, seen along -z in parallel projection. The field has waves, and its gradient vanishes
  // nowhere, so normals never reverse within a sample.
  const glm::ivec3 size{26, 30, 18};
  const glm::dvec3 spacing{1.0, 0.8, 1.7};
  const Lattice lattice(size, spacing, [&](const glm::dvec3& p) {
    const double r = glm::length((p - glm::dvec3(30.0, -4.0, 8.0)) / glm::dvec3(24.0, 20.0, 30.0));
    return std::clamp(1.5 - r + 0.06 * std::sin(0.7 * p.x) * std::cos(0.5 * p.y), 0.0, 1.0);
  });
  const Material material{{0.1, 0.5, 0.0}, {1.0, 0.0, 0.4}, 0.4, 0.6, 2.0};
  struct Case {
    const char* name;
    Shading shading;
    std::vector<Lamp> lamps;
  };
  // The camera's axes are those of the world.
  const Shading ambient{.on = true, .ambient = 0.4, .diffuse = 0.0, .lights = {Light{}}};
  const Shading three{.on = true,
                      .ambient = 0.1,
                      .diffuse = 0.5,
                      .lights = {{{0.0, 0.0, 2.0}, {0.6, 0.6, 0.6}},
                                 {{3.0, 1.0, 0.0}, {0.5, 0.1, 0.0}},
                                 {{-1.0, 2.0, -2.0}, {0.0, 0.3, 0.9}}}};
  std::vector<Case> cases;
  cases.push_back({"headlight", headlight(0.0, 1.0), {{{0.0, 0.0, 1.0}, {1.0, 1.0, 1.0}}}});
  cases.push_back({"ambient light alone", ambient, {}});
  cases.push_back({"three lights, half of which is reflected",
                   three,
                   {{{0.0, 0.0, 1.0}, {0.3, 0.3, 0.3}},
                    {{3.0, 1.0, 0.0}, {0.25, 0.05, 0.0}},
                    {{-1.0, 2.0, -2.0}, {0.0, 0.15, 0.45}}}});
  Camera camera;
  camera.focalPoint = 0.5 * glm::dvec3(size - 1) * spacing;
  camera.position = camera.focalPoint + glm::dvec3(0.0, 0.0, 100.0);
  camera.parallelProjection = true;
  camera.parallelScale = 14.0;
  VdiGenerator generator(test::device(), comm::Communicator::serial());
  // A sample has the light of its middle: fine samples match the integral, samples of a voxel nearly do.
  for (const auto& [type, rate, most] :
       {std::tuple(ScalarType::F32, 8.0, 1.0), std::tuple(ScalarType::U16, 8.0, 1.0),
        std::tuple(ScalarType::F32, 1.0, 5.0)}) {
    const double scale = type == ScalarType::F32 ? 1.0 : 60000.0;
    generator.setBlocks({lattice.block(type, scale)});
    for (const Case& c : cases) {
      INFO(c.name << ", " << toString(type) << ", rate " << rate);
      GenerateSettings settings = test::smallSettings(28, 24, 20);
      settings.shading = c.shading;
      settings.samplesPerVoxel = rate;
      const auto picture = generator.renderVolume(camera, material.function(scale), settings);
      const auto vdi = generator.generate(camera, material.function(scale), settings);
      const Image flat = flatten(*vdi);
      double worst = 0.0;
      double brightest = 0.0;
      for (int y = 0; y < settings.height; ++y) {
        for (int x = 0; x < settings.width; ++x) {
          const double perPixel = 2.0 * camera.parallelScale / settings.height;
          const auto expected = integral(lattice, material, {c.lamps, c.shading.ambient, {}},
                                         camera.focalPoint.x + (x + 0.5 - 0.5 * settings.width) * perPixel,
                                         camera.focalPoint.y + (y + 0.5 - 0.5 * settings.height) * perPixel);
          const auto pixel = static_cast<std::size_t>(y * settings.width + x);
          for (int channel = 0; channel < 4; ++channel) {
            const double truth = expected[static_cast<std::size_t>(channel)];
            worst = std::max({worst, std::abs(picture->rgba[pixel][channel] - truth),
                              std::abs(flat.rgba[pixel][channel] - truth)});
            if (channel < 3) brightest = std::max(brightest, truth);
          }
        }
      }
      CHECK(brightest > 0.15);
      CHECK(255.0 * worst < most);
    }
  }
}

TEST_CASE("shading: no gradient, no light; values of any size and ones that aren't finite") {
  VdiGenerator generator(test::device(), comm::Communicator::serial());
  const glm::ivec3 size(12);
  const Camera camera =
      Camera::framing({glm::dvec3(0.0), glm::dvec3(11.0)}, {0.0, 0.0, -1.0}, {0.0, 1.0, 0.0});
  const auto picture = [&](const std::function<double(const glm::dvec3&)>& value, double scale,
                           const Shading& shading) {
    const Lattice lattice(size, glm::dvec3(1.0), value);
    generator.setBlocks({lattice.block(ScalarType::F32, scale)});
    TransferFunction function{
        {{0.0, {1.0, 1.0, 1.0}}, {scale, {1.0, 1.0, 1.0}}}, {{0.0, 1.0}, {scale, 1.0}}, 1.0};
    GenerateSettings settings = test::smallSettings(16, 16);
    settings.shading = shading;
    return *generator.renderVolume(camera, function, settings);
  };
  const auto middleOf = [](const Image& image) {
    return image.rgba[static_cast<std::size_t>(image.height / 2 * image.width + image.width / 2)];
  };
  const auto constant = [](const glm::dvec3&) { return 0.7; };
  CHECK(middleOf(picture(constant, 1.0, headlight())).r == 0.0F);
  CHECK(middleOf(picture(constant, 1.0, headlight(0.25))).r == Approx(0.25).margin(1e-3));
  CHECK(middleOf(picture(constant, 1.0, headlight())).a > 0.99F);
  // A slope along the view axis, of any magnitude.
  const auto slope = [](const glm::dvec3& p) { return (p.z + 1.0) / 13.0; };
  for (const double scale : {1e-25, 1.0, 1e30}) CHECK(middleOf(picture(slope, scale, headlight())).r > 0.97F);
  const auto broken = [&slope](const glm::dvec3& p) {
    return p.x < 2.0 ? std::numeric_limits<double>::quiet_NaN() : p.y < 2.0 ? 1e39 : slope(p);
  };
  for (const glm::vec4& pixel : picture(broken, 1.0, kit()).rgba) {
    for (int c = 0; c < 4; ++c) CHECK((pixel[c] >= 0.0F && pixel[c] < 2.0F));
  }
}

TEST_CASE("shading: values out of range are refused by name") {
  const auto refused = [](const Shading& shading, const std::string& what) {
    GenerateSettings settings;
    settings.shading = shading;
    CHECK_THROWS_WITH(validate(settings), vdi::test::ContainsSubstring(what));
  };
  refused({.on = true, .ambient = -0.1}, "ambient");
  refused({.on = true, .diffuse = 1.5}, "diffuse");
  refused({.on = true, .lights = std::vector<Light>(9)}, "8 lights");
  refused({.on = true, .lights = {{glm::dvec3(NAN), glm::dvec3(1.0)}}}, "direction");
  refused({.on = true, .lights = {{glm::dvec3(0.0), glm::dvec3(-1.0)}}}, "colour");
}
