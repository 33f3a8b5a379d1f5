// Shading: the device against the reference, and against an integral in double precision that shares nothing
// with them: no table, no lattice of samples, no helper.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <tuple>
#include <vector>

#include "tests/Catch.h"
#include "tests/Devices.h"
#include "tests/Scenes.h"
#include "vdi/comm/GhostExchange.h"
#include "vdi/core/Error.h"
#include "vdi/pipeline/Pipeline.h"
#include "vdi/reference/Reference.h"

using namespace vdi;
using apps::Joint;
using apps::Layout;

namespace {

Shading headlight(double ambient = 0.0, double diffuse = 1.0) {
  return {.on = true, .ambient = ambient, .diffuse = diffuse, .lights = {Light{}}};
}

Shading kit() {
  return {.on = true};
}

float largestDifference(const Image& a, const Image& b) {
  REQUIRE(a.rgba.size() == b.rgba.size());
  float worst = 0.0F;
  for (std::size_t i = 0; i < a.rgba.size(); ++i) {
    for (int c = 0; c < 4; ++c) worst = std::max(worst, std::abs(a.rgba[i][c] - b.rgba[i][c]));
  }
  return worst * 255.0F;
}

/// A function of the place on a lattice, as plain numbers.
struct Lattice {
  glm::ivec3 size;
  glm::dvec3 spacing;
  std::vector<double> values;  // [z][y][x]

  Lattice(const glm::ivec3& theSize, const glm::dvec3& theSpacing,
          const std::function<double(const glm::dvec3&)>& function)
      : size(theSize), spacing(theSpacing) {
    for (int z = 0; z < size.z; ++z) {
      for (int y = 0; y < size.y; ++y) {
        for (int x = 0; x < size.x; ++x)
          values.push_back(static_cast<float>(function(glm::dvec3(x, y, z) * spacing)));
      }
    }
  }
  double valueAt(const std::array<double, 3>& place) const {
    std::array<int, 3> low{};
    std::array<double, 3> share{};
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      const double index = std::min(std::max(place[i] / spacing[axis], 0.0), size[axis] - 1.0);
      low[i] = std::min(static_cast<int>(index), size[axis] - 2);
      share[i] = index - low[i];
    }
    double sum = 0.0;
    for (int z = 0; z < 2; ++z) {
      for (int y = 0; y < 2; ++y) {
        for (int x = 0; x < 2; ++x) {
          const double weight = (x != 0 ? share[0] : 1 - share[0]) * (y != 0 ? share[1] : 1 - share[1]) *
                                (z != 0 ? share[2] : 1 - share[2]);
          const auto at =
              static_cast<std::size_t>(((low[2] + z) * size.y + low[1] + y) * size.x + low[0] + x);
          sum += weight * values[at];
        }
      }
    }
    return sum;
  }
  Block block(ScalarType type, double scale) const {
    const auto count = values.size();
    const std::shared_ptr<std::byte[]> data(new std::byte[count * sizeOf(type)]);
    for (std::size_t i = 0; i < count; ++i) storeValue(type, data.get(), i, values[i] * scale);
    Block result = Block::fromPoints(size, glm::dvec3(0.0), spacing, type, data.get());
    result.keepAlive = std::shared_ptr<const void>(data, data.get());
    return result;
  }
};

/// Colour and opacity of a scalar in [0, 1]: between the nodes, linearly; the functions below are given by
/// the same nodes.
struct Material {
  std::array<double, 3> low;
  std::array<double, 3> high;
  double opaqueFrom;  // opacity rises from here to `opacity` at 1
  double opacity;
  double unit;

  TransferFunction function(double scale) const {
    return {{{0.0, {low[0], low[1], low[2]}}, {scale, {high[0], high[1], high[2]}}},
            {{0.0, 0.0}, {opaqueFrom * scale, 0.0}, {scale, opacity}},
            unit};
  }
};

struct Lamp {
  std::array<double, 3> towards;  // world
  std::array<double, 3> color;
};

/// Along -z through (x, y), by steps of a 64th of a voxel.
std::array<double, 4> integral(const Lattice& lattice, const Material& material,
                               const std::vector<Lamp>& lamps, double ambient, double x, double y) {
  std::array<double, 4> sum{};
  const double top = (lattice.size.z - 1) * lattice.spacing.z;
  const double step = std::min({lattice.spacing.x, lattice.spacing.y, lattice.spacing.z}) / 64.0;
  if (x < 0 || y < 0 || x > (lattice.size.x - 1) * lattice.spacing.x ||
      y > (lattice.size.y - 1) * lattice.spacing.y)
    return sum;
  for (double z = top - 0.5 * step; z > 0.0; z -= step) {
    const double value = lattice.valueAt({x, y, z});
    const double share = (value - material.opaqueFrom) / (1.0 - material.opaqueFrom);
    if (share <= 0.0) continue;
    const double opacity =
        1.0 - std::pow(1.0 - material.opacity * std::min(share, 1.0), step / material.unit);
    std::array<double, 3> gradient{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double h = lattice.spacing[static_cast<int>(axis)];
      std::array<double, 3> ahead{x, y, z};
      std::array<double, 3> behind{x, y, z};
      ahead[axis] += h;
      behind[axis] -= h;
      gradient[axis] = (lattice.valueAt(ahead) - lattice.valueAt(behind)) / h;
    }
    const double length = std::hypot(gradient[0], gradient[1], gradient[2]);
    for (std::size_t c = 0; c < 3; ++c) {
      double light = ambient;
      for (const Lamp& lamp : lamps) {
        const double size = std::hypot(lamp.towards[0], lamp.towards[1], lamp.towards[2]);
        const double along =
            gradient[0] * lamp.towards[0] + gradient[1] * lamp.towards[1] + gradient[2] * lamp.towards[2];
        if (length > 0.0) light += lamp.color[c] * std::abs(along) / (length * size);
      }
      const double color =
          material.low[c] + std::min(std::max(value, 0.0), 1.0) * (material.high[c] - material.low[c]);
      sum[c] += (1.0 - sum[3]) * opacity * color * light;
    }
    sum[3] += (1.0 - sum[3]) * opacity;
  }
  return sum;
}

}  // namespace

TEST_CASE("shading: DVR and lists of the device are the reference's") {
  const std::vector<std::shared_ptr<gpu::Device>> devices{test::device(), test::makeDevice(true)};
  struct Case {
    ScalarType type;
    Joint joint;
    bool parallel;
    Shading shading;
  };
  Shading turned = kit();
  turned.lights = {{{1.0, 2.0, 0.5}, {0.9, 0.2, 0.1}}, {{0.0, 0.0, 0.0}, {0.1, 0.2, 0.5}}};
  std::vector<Case> cases;
  cases.push_back({ScalarType::F32, Joint::SharedPoints, false, kit()});
  cases.push_back({ScalarType::U8, Joint::Cells, false, headlight(0.2, 0.7)});
  cases.push_back({ScalarType::F64, Joint::SharedPoints, true, turned});
  for (const auto& device : devices) {
    VdiGenerator generator(device, comm::Communicator::serial());
    for (const Case& c : cases) {
      INFO(toString(c.type));
      const auto decomposed =
          test::decompose("turbulence", {26, 22, 24}, {2, 2, 2}, Layout::OnOneRank, c.joint, c.type, 0, 1);
      const TransferFunction function = test::threeHues(test::topOf(c.type) * 0.8);
      GenerateSettings settings = test::smallSettings(31, 23, 8);
      settings.precision = Precision::Full;
      settings.shading = c.shading;
      const Camera camera = test::oblique(c.parallel);
      generator.setBlocks(decomposed.mine);
      const reference::Frame frame(generator.scene(), camera, function, settings);
      const auto blocks = comm::exchangeGhosts(comm::Communicator::serial(), decomposed.mine);
      const Image expected = reference::renderVolume(frame, blocks);
      const auto image = generator.renderVolume(camera, function, settings);
      CHECK(largestDifference(*image, expected) < 1.5F);
      const auto vdi = generator.generate(camera, function, settings);
      CHECK(largestDifference(flatten(*vdi), expected) < 1.5F);
      // It's not the picture without light.
      GenerateSettings plain = settings;
      plain.shading.on = false;
      const auto unlit = generator.renderVolume(camera, function, plain);
      CHECK(largestDifference(*unlit, expected) > 30.0F);
    }
  }
}

TEST_CASE("shading: the optical model's integral, per channel") {
  // Anisotropic voxels, seen along -z without perspective. A field with waves, whose gradient vanishes
  // nowhere: normals turn round there within any sample.
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
  // The camera's axes are the world's.
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
  // A sample has the light of its middle: fine samples show the integral, ones of a voxel nearly so.
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
          const auto expected = integral(lattice, material, c.lamps, c.shading.ambient,
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
  // A slope along the view axis, whatever its size.
  const auto slope = [](const glm::dvec3& p) { return (p.z + 1.0) / 13.0; };
  for (const double scale : {1e-25, 1.0, 1e30}) CHECK(middleOf(picture(slope, scale, headlight())).r > 0.97F);
  const auto broken = [&slope](const glm::dvec3& p) {
    return p.x < 2.0 ? std::numeric_limits<double>::quiet_NaN() : p.y < 2.0 ? 1e39 : slope(p);
  };
  for (const glm::vec4& pixel : picture(broken, 1.0, kit()).rgba) {
    for (int c = 0; c < 4; ++c) CHECK((pixel[c] >= 0.0F && pixel[c] < 2.0F));
  }
}

TEST_CASE("shading: what is out of range is refused by name") {
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
