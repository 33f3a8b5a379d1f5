// Blend modes other than composite: pictures of the device compared with the reference's, and both with the
// rays' extremes and crossings in double precision, which share nothing with them.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "tests/Catch.h"
#include "tests/Devices.h"
#include "tests/Scenes.h"
#include "tests/pipeline/AgainstReference.h"
#include "tests/pipeline/Integral.h"
#include "tests/pipeline/OpticalBounds.h"
#include "vdi/core/SettingsTable.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vdi/reference/Reference.h"

using namespace vdi;
using synthetic::Joint;

namespace {

/// The modes, with isovalues at shares of [0, top].
std::vector<Blending> modes(double top) {
  return {{BlendMode::Maximum, {}},
          {BlendMode::Minimum, {}},
          {BlendMode::Isosurface, {0.7 * top, 0.45 * top, 0.55 * top}}};
}

/// A function that shows low and high scalars, so that minima and maxima are seen.
TransferFunction valley(double top) {
  TransferFunction function = test::threeHues(top);
  function.opacities = {{0.0, 0.9}, {0.3 * top, 0.4}, {0.5 * top, 0.1}, {0.75 * top, 0.6}, {top, 0.0}};
  return function;
}

struct Case {
  ScalarType type;
  Joint joint;
  bool parallel;
  bool shaded;
};

void checkAgainstReference(VdiGenerator& generator, const Case& c) {
  const auto decomposed = test::onOneRank("turbulence", {26, 22, 24}, {2, 2, 2}, c.type, c.joint);
  const double top = test::topOf(c.type);
  const TransferFunction function = valley(top);
  const Camera camera = test::oblique(c.parallel);
  generator.setBlocks(decomposed.mine);
  const auto blocks = test::withLayers(decomposed.mine);
  GenerateSettings settings = test::smallSettings(31, 23, 8);
  settings.shading.on = c.shaded;
  const auto composite = generator.renderVolume(camera, function, settings);
  for (const Blending& blending : modes(top)) {
    INFO(toString(blending.mode) << ", " << toString(c.type));
    settings.blending = blending;
    const reference::RayInputs inputs(generator.scene(), camera, function, settings);
    const Image expected = reference::renderVolume(inputs, blocks);
    const auto image = generator.renderVolume(camera, function, settings);
    const test::Off off = test::offBetween(*image, expected);
    // Rounding decides whether a ray that just touches a surface crosses it. The filters of GPUs
    // have 8 bits.
    const double touching = test::device()->isCpu() ? 0.005 : 0.015;
    CHECK(off.pixels <= (blending.mode == BlendMode::Isosurface ? touching : 0.0));
    CHECK(off.mean < 0.3);
    CHECK(test::offBetween(*composite, expected).mean > 5.0);
    std::size_t otherDepths = 0;
    for (std::size_t i = 0; i < expected.depth.size(); ++i) {
      CHECK((image->depth[i] == Image::noDepth) == (image->rgba[i].a == 0.0F));
      const bool both = image->depth[i] != Image::noDepth && expected.depth[i] != Image::noDepth;
      if (both && std::abs(image->depth[i] - expected.depth[i]) > 0.01) ++otherDepths;
    }
    CHECK(otherDepths <= expected.depth.size() / 100);  // where two places have nearly the same scalar
  }
}

}  // namespace

TEST_CASE("blending: extremes and isosurfaces of the device are the reference's", "[pictures]") {
  // Nearly all of the time goes into compiling a program for each of these.
  VdiGenerator onCpu(test::device(), comm::Communicator::serial());
  checkAgainstReference(onCpu, {ScalarType::F32, Joint::SharedPoints, false, false});
  checkAgainstReference(onCpu, {ScalarType::F64, Joint::SharedPoints, true, true});
  VdiGenerator asGpu(test::deviceAsGpu(), comm::Communicator::serial());
  checkAgainstReference(asGpu, {ScalarType::U8, Joint::Cells, false, true});
}

TEST_CASE("blending: the oracle's extremes and crossings, worked out by hand") {
  // The scalar is z, from 0 to 1.
  const reference::ExactVolume ramp{{2, 2, 2},
                                    glm::dvec3(0.0),
                                    glm::dvec3(1.0),
                                    {glm::dvec3(0.0), glm::dvec3(1.0)},
                                    {0, 0, 0, 0, 1, 1, 1, 1}};
  const TransferFunction function{{{0.0, {1, 0, 0}}, {1.0, {0, 1, 0}}}, {{0.0, 0.2}, {1.0, 0.6}}, 0.01};
  const glm::dvec3 low{0.3, 0.6, 0.25};
  const glm::dvec3 high{0.3, 0.6, 0.75};
  const auto about = [](const glm::dvec4& seen, const glm::dvec4& expected) {
    CHECK(glm::length(seen - expected) < 1e-9);
  };
  about(reference::project(ramp, function, low, high, 8, true), {0.25 * 0.5, 0.75 * 0.5, 0.0, 0.5});
  about(reference::project(ramp, function, high, low, 8, false), {0.75 * 0.3, 0.25 * 0.3, 0.0, 0.3});
  // The nearer one of the surfaces at 0.3 and 0.6 hides some of the other; that at 0.8 isn't on the ray.
  const glm::dvec4 a(0.7 * 0.32, 0.3 * 0.32, 0.0, 0.32);
  const glm::dvec4 b(0.4 * 0.44, 0.6 * 0.44, 0.0, 0.44);
  about(reference::cross(ramp, function, {0.6, 0.8, 0.3}, low, high, 3), a + (1.0 - a.a) * b);
  about(reference::cross(ramp, function, {0.6, 0.8, 0.3}, high, low, 3), b + (1.0 - b.a) * a);
}

TEST_CASE("blending: extremes and isosurfaces in double precision") {
  for (const test::Stretch& stretch : {test::stretches[6], test::stretches[2]}) {
    const test::OpticalScene scene = test::opticalScene(stretch, Joint::SharedPoints);
    VdiGenerator generator(test::device(), comm::Communicator::serial());
    generator.setBlocks(scene.mine);
    const std::vector<Block> blocks = test::withLayers(scene.mine);
    const TransferFunction function = test::namedFunctions(stretch).front().function;
    for (Blending blending : modes(1.0)) {
      for (double& value : blending.isovalues) value = stretch.at(value);
      for (const bool parallel : {false, true}) {
        const Camera camera = test::lookingAt(parallel);
        GenerateSettings settings = test::opticalSettings(8.0);
        settings.blending = blending;
        const Image expected = reference::renderExactly(scene.whole, function, camera, settings.width,
                                                        settings.height, 64, blending);
        REQUIRE(test::mostOpaque(expected) > 0.25F);
        INFO(toString(blending.mode) << ", " << toString(stretch.type));
        const reference::RayInputs inputs(generator.scene(), camera, function, settings);
        for (const Image& seen :
             {*generator.renderVolume(camera, function, settings), reference::renderVolume(inputs, blocks)}) {
          const test::Off off = test::offBetween(seen, expected);
          // Surfaces have edges, and a pixel at an edge is either right or completely wrong.
          const bool edges = blending.mode == BlendMode::Isosurface;
          CHECK(off.mean <= (edges ? 0.5 : 0.2));
          CHECK(off.pixels <= (edges ? 0.01 : 0.0));
        }
      }
    }
  }
}

TEST_CASE("blending: an extreme that the transfer function hides still counts, and NaN never does") {
  // The scalar rises along z; x < 3 is NaN.
  const test::Lattice lattice(glm::ivec3(40), glm::dvec3(1.0), [](const glm::dvec3& p) {
    return p.x < 3.0 ? std::numeric_limits<double>::quiet_NaN() : p.z / 39.0;
  });
  VdiGenerator generator(test::device(), comm::Communicator::serial());
  generator.setBlocks({lattice.block(ScalarType::F32, 1.0)});
  const Camera camera =
      Camera::framing({glm::dvec3(0.0), glm::dvec3(39.0)}, {0.0, 0.0, -1.0}, {0.0, 1.0, 0.0});
  // Macrocells with nothing visible hold the maxima.
  const TransferFunction function{
      {{0.0, {1, 1, 1}}, {1.0, {0, 0, 0}}}, {{0.0, 0.8}, {0.3, 0.8}, {0.35, 0.0}, {1.0, 0.0}}, 1.0};
  GenerateSettings settings = test::smallSettings(24, 24);
  const auto middleOf = [&](BlendMode mode) {
    settings.blending.mode = mode;
    const auto image = generator.renderVolume(camera, function, settings);
    return std::pair(image->rgba[12 * 24 + 12], *image);
  };
  CHECK(middleOf(BlendMode::Maximum).first.a == 0.0F);
  const auto [middle, image] = middleOf(BlendMode::Minimum);
  CHECK(middle.a == Approx(0.8).margin(0.01));
  CHECK(middle.r == Approx(0.8).margin(0.01));
  for (const glm::vec4& pixel : image.rgba) {
    for (int c = 0; c < 4; ++c) CHECK((pixel[c] >= 0.0F && pixel[c] <= 1.0F));
  }
  // A column of only NaN is as transparent as the space beside the volume.
  CHECK(image.rgba[12 * 24 + 23].a == 0.0F);
}

TEST_CASE("blending: surfaces at any sampling rate, and a region's part of them") {
  const test::Lattice lattice(glm::ivec3(24), glm::dvec3(1.0),
                              [](const glm::dvec3& p) { return glm::length(p - glm::dvec3(11.5)) / 12.0; });
  VdiGenerator generator(test::device(), comm::Communicator::serial());
  generator.setBlocks({lattice.block(ScalarType::F32, 1.0)});
  const Camera camera =
      Camera::framing({glm::dvec3(0.0), glm::dvec3(23.0)}, {0.0, 0.0, -1.0}, {0.0, 1.0, 0.0});
  const TransferFunction function{{{0.0, {1, 0, 0}}, {1.0, {0, 0, 1}}}, {{0.0, 0.5}, {1.0, 0.5}}, 1.0};
  GenerateSettings settings = test::smallSettings(32, 32);
  settings.blending = {BlendMode::Isosurface, {0.5}};
  // A ray through a sphere crosses it twice.
  for (const double rate : {0.1, 0.5, 1.0, 4.0}) {
    settings.samplesPerVoxel = rate;
    INFO(rate);
    CHECK(generator.renderVolume(camera, function, settings)->rgba[16 * 32 + 16].a ==
          Approx(0.75).margin(1e-3));
  }
  settings.region.planes = {{{11.5, 11.5, 11.5}, {0.0, 0.0, 1.0}}};
  CHECK(generator.renderVolume(camera, function, settings)->rgba[16 * 32 + 16].a == Approx(0.5).margin(1e-3));
}

TEST_CASE("blending: several surfaces within one sample, the nearest first") {
  // The scalar rises along z, over one voxel, which is less than a sample.
  const test::Lattice lattice({8, 8, 2}, glm::dvec3(1.0), [](const glm::dvec3& p) { return p.z; });
  VdiGenerator generator(test::device(), comm::Communicator::serial());
  generator.setBlocks({lattice.block(ScalarType::F32, 1.0)});
  const TransferFunction function{{{0.0, {1, 0, 0}}, {1.0, {0, 0, 1}}}, {{0.0, 0.5}, {1.0, 0.5}}, 1.0};
  GenerateSettings settings = test::smallSettings(32, 32);
  settings.samplesPerVoxel = 0.6;
  settings.blending = {BlendMode::Isosurface, {0.2, 0.7}};
  const auto middleFrom = [&](double direction) {
    const Camera camera =
        Camera::framing({glm::dvec3(0.0), glm::dvec3(7.0, 7.0, 1.0)}, {0.0, 0.0, direction}, {0.0, 1.0, 0.0});
    return generator.renderVolume(camera, function, settings)->rgba[16 * 32 + 16];
  };
  const glm::vec4 high(0.15F, 0.0F, 0.35F, 0.5F);  // expected for 0.7
  const glm::vec4 low(0.4F, 0.0F, 0.1F, 0.5F);
  CHECK(glm::length(middleFrom(-1.0) - (high + 0.5F * low)) < 2e-3F);
  CHECK(glm::length(middleFrom(1.0) - (low + 0.5F * high)) < 2e-3F);
}

TEST_CASE("blending: what can't be is refused by name") {
  const auto refused = [](const Blending& blending, const std::string& what) {
    GenerateSettings settings;
    settings.blending = blending;
    CHECK_THROWS_WITH(validate(settings), vdi::test::ContainsSubstring(what));
  };
  refused({BlendMode::Isosurface, {}}, "at least one isovalue");
  refused({BlendMode::Isosurface, std::vector<double>(17, 0.5)}, "16 isovalues");
  refused({BlendMode::Isosurface, {0.5, NAN}}, "finite");
  refused({BlendMode::Maximum, {0.5}}, "isovalues need blend mode isosurface, not maximum");
  CHECK_THROWS_WITH(blendModeFromString("mip"),
                    vdi::test::ContainsSubstring("composite, maximum, minimum or isosurface"));
  // A VDI holds only composite blending.
  const test::Lattice lattice(glm::ivec3(4), glm::dvec3(1.0), [](const glm::dvec3& p) { return p.x / 3.0; });
  VdiGenerator generator(test::device(), comm::Communicator::serial());
  generator.setBlocks({lattice.block(ScalarType::F32, 1.0)});
  const Camera camera =
      Camera::framing({glm::dvec3(0.0), glm::dvec3(3.0)}, {0.0, 0.0, -1.0}, {0.0, 1.0, 0.0});
  GenerateSettings settings = test::smallSettings(8, 8);
  for (const Blending& blending : modes(1.0)) {
    settings.blending = blending;
    CHECK_THROWS_WITH(generator.generate(camera, test::threeHues(1.0), settings),
                      vdi::test::ContainsSubstring("only composite blending"));
  }
  settings.blending = {};
  CHECK_NOTHROW(generator.generate(camera, test::threeHues(1.0), settings));
}
