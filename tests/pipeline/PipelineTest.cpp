// Each device pass compared with the reference, and a VDI compared with DVR.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <optional>

#include "tests/Catch.h"
#include "tests/Devices.h"
#include "tests/Scenes.h"
#include "tests/pipeline/HostLists.h"
#include "vdi/comm/GhostExchange.h"
#include "vdi/core/Error.h"
#include "vdi/core/Flatten.h"
#include "vdi/core/ImageMetrics.h"
#include "vdi/core/Margin.h"
#include "vdi/io/Png.h"
#include "vdi/pipeline/Compositor.h"
#include "vdi/pipeline/RayCaster.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vdi/pipeline/VdiRenderer.h"
#include "vdi/reference/Compaction.h"
#include "vdi/reference/Reference.h"

using namespace vdi;
using synthetic::Joint;
using synthetic::Layout;
using test::device;

namespace {

/// A second device, which runs the programs for GPUs.
std::shared_ptr<gpu::Device> deviceAsGpu() {
  return device(true);
}

/// The blocks with the layers of values beyond their owned boxes that setBlocks also gives them.
std::vector<Block> withLayers(const std::vector<Block>& blocks) {
  return comm::exchangeGhosts(comm::Communicator::serial(), blocks);
}

float largestDifference(const Image& a, const Image& b) {
  REQUIRE(a.rgba.size() == b.rgba.size());
  float worst = 0.0F;
  for (std::size_t i = 0; i < a.rgba.size(); ++i) {
    for (int c = 0; c < 4; ++c) worst = std::max(worst, std::abs(a.rgba[i][c] - b.rgba[i][c]));
  }
  return worst * 255.0F;
}

/// Whether the device's view equals the reference's. Where rounding decides to which place a face leans, a
/// sheared view has a pixel or two of its own.
bool isView(const Image& seen, const Image& expected, Reconstruction reconstruction) {
  const bool sheared = reconstruction == Reconstruction::Sheared;
  std::size_t different = 0;
  for (std::size_t i = 0; i < seen.rgba.size(); ++i) {
    const glm::vec4 difference = 255.0F * glm::abs(seen.rgba[i] - expected.rgba[i]);
    different += glm::any(glm::greaterThan(difference, glm::vec4(2.0F))) ? 1 : 0;
  }
  INFO(different << " pixels differ");
  return seen.rgba.size() == expected.rgba.size() && different <= (sheared ? seen.rgba.size() / 500 : 0) &&
         largestDifference(seen, expected) < (sheared ? 16.0F : 2.0F);
}

ImageDifference differenceOf(const Image& a, const Image& b) {
  return compare(io::toPicture(a).rgb, io::toPicture(b).rgb, a.width, a.height, 3);
}

/// Number of pixels of which only one has a depth, or whose depths are more than `tolerance` apart.
std::size_t depthsThatDiffer(const Image& a, const Image& b, float tolerance) {
  REQUIRE(a.depth.size() == b.depth.size());
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.depth.size(); ++i)
    count += a.depth[i] == b.depth[i] || std::abs(a.depth[i] - b.depth[i]) < tolerance ? 0 : 1;
  return count;
}

/// GPUs interpolate with 8-bit weights, CPU devices and the reference with floats, which matters where a
/// transfer function is steep.
template <typename T>
T byFilter(T precise, T coarse) {
  return device()->isCpu() ? precise : coarse;
}

constexpr float rounding = 2e-3F;
constexpr float oneCode = 1.5F / 255.0F;

bool alike(const Supersegment& a, const Supersegment& b, float tolerance) {
  const auto close = [&](float x, float y) { return std::abs(x - y) < tolerance; };
  return close(a.front, b.front) && close(a.back, b.back) && close(a.red, b.red) && close(a.green, b.green) &&
         close(a.blue, b.blue) && close(a.opacity, b.opacity);
}

/// Rounding may change a decision, so a few differences are expected.
std::size_t listsThatDiffer(const SupersegmentLists& a, const SupersegmentLists& b,
                            float tolerance = rounding) {
  REQUIRE(a.listCount() == b.listCount());
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.listCount(); ++i) {
    const auto x = a.list(i);
    const auto y = b.list(i);
    const auto same = [&](const Supersegment& s, const Supersegment& t) { return alike(s, t, tolerance); };
    count += std::equal(x.begin(), x.end(), y.begin(), y.end(), same) ? 0 : 1;
  }
  return count;
}

constexpr Algorithm algorithms[] = {Algorithm::Merge, Algorithm::Bisection};

}  // namespace

TEST_CASE("DVR, generation and rendering on the device equal the reference") {
  for (const bool parallel : {false, true}) {
    for (const ScalarType type : {ScalarType::U8, ScalarType::I8, ScalarType::U16, ScalarType::I16,
                                  ScalarType::U32, ScalarType::I32, ScalarType::F32, ScalarType::F64}) {
      if (parallel && type != ScalarType::F32) continue;
      INFO(toString(type) << (parallel ? ", parallel" : ", perspective"));
      const auto decomposed = test::decompose("turbulence", {26, 22, 24}, {2, 2, 2}, Layout::OnOneRank,
                                              Joint::SharedPoints, type, 0, 1);
      const TransferFunction function = test::threeHues(test::topOf(type) * 0.8);
      // Odd sizes: the last row and column lie beyond the last counted ones.
      const GenerateSettings settings = test::smallSettings(47, 35, 8);
      const Camera camera = test::oblique(parallel);
      VdiGenerator generator(device(), comm::Communicator::serial());
      generator.setBlocks(decomposed.mine);
      ScalarRange range;
      for (const Block& block : decomposed.mine) range.include(finiteRange(block));
      CHECK(generator.scalarRange() == range);
      const reference::Frame frame(generator.scene(), camera, function, settings);

      const auto image = generator.renderVolume(camera, function, settings);
      const Image expected = reference::renderVolume(frame, withLayers(decomposed.mine));
      CHECK(largestDifference(*image, expected) < 0.5F);
      CHECK(depthsThatDiffer(*image, expected, 1e-3F) <= image->depth.size() / 100);

      std::optional<Vdi> vdi;
      for (const Algorithm algorithm : algorithms) {
        INFO(toString(algorithm));
        GenerateSettings own = settings;
        own.algorithm = algorithm;
        const reference::Frame ownFrame(generator.scene(), camera, function, own);
        const SupersegmentLists lists = reference::generate(ownFrame, withLayers(decomposed.mine), false);
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

TEST_CASE("a margin: the reference's lists around the picture, and no cut edge when the view turns") {
  for (const bool parallel : {false, true}) {
    INFO((parallel ? "parallel" : "perspective"));
    const auto decomposed = test::decompose("turbulence", {26, 22, 24}, {2, 2, 2}, Layout::OnOneRank,
                                            Joint::SharedPoints, ScalarType::F32, 0, 1);
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
    const reference::Frame frame(generator.scene(), camera, function, settings);
    const SupersegmentLists lists = reference::generate(frame, withLayers(decomposed.mine), false);
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

TEST_CASE("rays leave a picture within a tile of lists, through material at its edge") {
  const auto decomposed = test::decompose("interface", {24, 24, 24}, {1, 1, 1}, Layout::OnOneRank,
                                          Joint::SharedPoints, ScalarType::F32, 0, 1);
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks(decomposed.mine);
  Camera camera = test::oblique();
  camera.position = camera.focalPoint + 0.25 * (camera.position - camera.focalPoint);
  const auto vdi = generator.generate(camera, test::threeHues(0.8), test::smallSettings(60, 60, 25));
  for (const auto& each : {device(), deviceAsGpu()}) {
    VdiRenderer renderer(each);
    renderer.setVdi(*vdi);
    for (const double angle : {120.0, 160.0, 200.0, 240.0}) {
      INFO(angle);
      // There are many rays: rounding lets a few of them pass the last list.
      const Image seen = renderer.render(camera.azimuth(angle), 160, 160);
      const auto isSound = [](const glm::vec4& p) { return p.a >= 0.0F && p.a <= 1.0F && p.r >= 0.0F; };
      CHECK(std::all_of(seen.rgba.begin(), seen.rgba.end(), isSound));
      CHECK(std::any_of(seen.rgba.begin(), seen.rgba.end(), [](const glm::vec4& p) { return p.a > 0.5F; }));
    }
  }
}

TEST_CASE("macrocells that rays pass and samples that are counted as one: as in the reference") {
  // Each axis has several macrocells, most of them empty.
  const auto decomposed = test::decompose("coil", {70, 75, 66}, {1, 2, 1}, Layout::OnOneRank,
                                          Joint::SharedPoints, ScalarType::U8, 0, 1);
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks(decomposed.mine);
  GenerateSettings settings = test::smallSettings(41, 33, 6);
  settings.precision = Precision::Full;
  for (const double top : {80.0, 30.0, 200.0}) {  // with the last one, almost nothing is visible
    INFO(top);
    // The smaller the budget, the more samples count as one.
    settings.supersegments = top == 80.0 ? 6 : top == 30.0 ? 1 : 3;
    const TransferFunction function = test::threeHues(top);
    const reference::Frame frame(generator.scene(), test::oblique(), function, settings);
    const Image expected = reference::renderVolume(frame, withLayers(decomposed.mine));
    CHECK(largestDifference(*generator.renderVolume(test::oblique(), function, settings), expected) <
          byFilter(0.5F, 2.0F));
    for (const Algorithm algorithm : algorithms) {
      INFO(toString(algorithm));
      GenerateSettings own = settings;
      own.algorithm = algorithm;
      const reference::Frame ownFrame(generator.scene(), test::oblique(), function, own);
      const SupersegmentLists lists = reference::generate(ownFrame, withLayers(decomposed.mine), false);
      const auto vdi = generator.generate(test::oblique(), function, own);
      CHECK(listsThatDiffer(vdi->expandedLists(), lists) <= lists.listCount() / 50);
    }
  }
}

TEST_CASE(
    "values that are copied as they are and values that are staged, several buffers full, give one picture") {
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

TEST_CASE("rays go on behind material of opacity 1, unless they must end") {
  const auto decomposed = test::decompose("shells", {32, 32, 32}, {1, 1, 1}, Layout::OnOneRank,
                                          Joint::SharedPoints, ScalarType::F32, 0, 1);
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
    const reference::Frame frame(generator.scene(), test::oblique(), function, settings);
    const SupersegmentLists expected = reference::generate(frame, withLayers(decomposed.mine), false);
    CHECK(listsThatDiffer(vdi->expandedLists(), expected) <=
          expected.listCount() / byFilter<std::size_t>(50, 4));
    // A device reads values at the scene's faces up to 2/256 of a voxel inside (VolumeStore.cpp); opaque
    // material there shows the colour of exactly that place.
    CHECK(largestDifference(flatten(*vdi), reference::renderVolume(frame, withLayers(decomposed.mine))) <
          byFilter(2.0F, 4.0F));
    counts.push_back(vdi->supersegmentCount());
  }
  CHECK(counts[1] > 2 * counts[0]);
}

TEST_CASE("a VDI in the memory of another one, whatever its precision and size were, is the same") {
  const auto decomposed = test::decompose("mixing", {24, 24, 24}, {1, 1, 1}, Layout::OnOneRank,
                                          Joint::SharedPoints, ScalarType::F32, 0, 1);
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks(decomposed.mine);
  GenerateSettings settings = test::smallSettings(40, 30, 5);
  const auto vdiOf = [&] { return *generator.generate(test::oblique(), test::threeHues(1.0), settings); };
  const Vdi first = vdiOf();
  for (const Precision precision : {Precision::Compact, Precision::Full, Precision::Compact}) {
    settings = test::smallSettings(60, 50, 9);
    settings.precision = precision;
    vdiOf();
    settings = test::smallSettings(40, 30, 5);
    Vdi again = vdiOf();
    CHECK(again == first);
    // Also in the memory of a picture that is as large, or smaller.
    again = {};
    again = vdiOf();
    CHECK(again == first);
    settings = test::smallSettings(12, 10, 3);
    vdiOf();
    settings = test::smallSettings(40, 30, 5);
    CHECK(vdiOf() == first);
  }
}

TEST_CASE("a picture in the memory of another one is the same") {
  const auto decomposed = test::decompose("mixing", {24, 24, 24}, {1, 1, 1}, Layout::OnOneRank,
                                          Joint::SharedPoints, ScalarType::F32, 0, 1);
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks(decomposed.mine);
  const auto volumeOf = [&](int width, int height) {
    return *generator.renderVolume(test::oblique(), test::threeHues(1.0),
                                   test::smallSettings(width, height, 5));
  };
  const auto vdi = generator.generate(test::oblique(), test::threeHues(1.0), test::smallSettings(40, 30, 5));
  VdiRenderer renderer(device());
  renderer.setVdi(*vdi);
  const auto same = [](const Image& a, const Image& b) {
    return a.width == b.width && a.height == b.height && a.rgba == b.rgba && a.depth == b.depth;
  };
  const Image volume = volumeOf(40, 30);
  const Image view = renderer.render(test::oblique(), 40, 30);
  for (const auto& [width, height] : {std::pair(60, 50), std::pair(40, 30), std::pair(9, 7)}) {
    INFO(width << " x " << height);
    volumeOf(width, height);
    CHECK(same(volumeOf(40, 30), volume));
    renderer.render(test::oblique().azimuth(20.0), width, height);
    CHECK(same(renderer.render(test::oblique(), 40, 30), view));
  }
}

TEST_CASE("bytes of a view are those of its floats, whichever was asked for before") {
  const auto decomposed = test::decompose("shells", {24, 24, 24}, {1, 1, 1}, Layout::OnOneRank,
                                          Joint::SharedPoints, ScalarType::F32, 0, 1);
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks(decomposed.mine);
  VdiRenderer renderer(device());
  renderer.setVdi(*generator.generate(test::oblique(), test::threeHues(1.0), test::smallSettings(40, 30, 5)));
  for (const auto& [width, height] : {std::pair(61, 47), std::pair(33, 64), std::pair(61, 47)}) {
    INFO(width << " x " << height);
    const Camera camera = test::oblique().azimuth(width);
    const Image floats = renderer.render(camera, width, height);
    for (const Alpha alpha : {Alpha::Premultiplied, Alpha::Straight}) {
      const ImageBytes bytes = renderer.renderBytes(camera, width, height, alpha);
      CHECK((bytes.width == width && bytes.height == height));
      REQUIRE(bytes.rgba.size() == floats.rgba.size());
      CHECK(std::ranges::equal(bytes.depth, floats.depth));
      int maximum = 0;
      int translucent = 0;
      for (std::size_t i = 0; i < bytes.rgba.size(); ++i) {
        const glm::vec4& shares = floats.rgba[i];
        translucent += shares.a > 0.1F && shares.a < 0.9F ? 1 : 0;
        const float weight = alpha == Alpha::Straight && shares.a > 0.0F ? 1.0F / shares.a : 1.0F;
        for (int c = 0; c < 4; ++c) {
          const int expected = toByte(c < 3 ? shares[c] * weight : shares.a);
          maximum = std::max(maximum, std::abs(bytes.rgba[i][c] - expected));
        }
      }
      // A device's division may be off in the last bits.
      CHECK(maximum <= (alpha == Alpha::Straight ? 1 : 0));
      CHECK(translucent > 100);
    }
  }
  CHECK(device()->validationMessages() == "");
}

TEST_CASE("views of a sparse VDI, most of whose tiles are skipped: as in the reference") {
  const auto decomposed = test::decompose("coil", {40, 40, 40}, {1, 1, 1}, Layout::OnOneRank,
                                          Joint::SharedPoints, ScalarType::U8, 0, 1);
  const bool parallel = GENERATE(false, true);
  const Camera camera = test::oblique(parallel);
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks(decomposed.mine);
  const auto vdi = generator.generate(camera, test::threeHues(80.0), test::smallSettings(121, 83, 6));
  VdiRenderer renderer(device());
  renderer.setVdi(*vdi);
  VdiRenderer rendererAsGpu(deviceAsGpu());
  rendererAsGpu.setVdi(*vdi);
  std::vector<Camera> cameras;
  for (const double angle : {2.0, 20.0, 70.0, 160.0, 290.0}) {
    cameras.push_back(camera.azimuth(angle));
    cameras.back().viewUp += 0.2 * glm::dvec3(1.0, 0.0, 0.5);
  }
  // Near V_O, across its picture's columns and rows.
  cameras.push_back(camera.azimuth(5.0));
  Camera above = camera;
  above.viewUp = glm::cross(camera.focalPoint - camera.position, camera.viewUp);
  above = above.azimuth(5.0);
  above.viewUp = camera.viewUp;
  cameras.push_back(above);
  // From inside the scene, outwards and back to V_O; and with the other projection.
  Camera inside = camera;
  inside.position = camera.focalPoint + glm::dvec3(0.1, 0.05, -0.1);
  inside.focalPoint = camera.focalPoint + glm::dvec3(0.6, -0.1, 0.3);
  inside.parallelProjection = false;
  cameras.push_back(inside);
  inside.focalPoint = camera.position;
  cameras.push_back(inside);
  cameras.push_back(test::oblique(!parallel).azimuth(15.0));
  std::size_t seenFrom = 0;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    for (const Reconstruction reconstruction : test::reconstructions) {
      INFO("camera " << i << ", " << toString(reconstruction) << ", parallel " << parallel);
      const Image expected = reference::render(*vdi, View(cameras[i], 65, 47), reconstruction);
      seenFrom += std::any_of(expected.rgba.begin(), expected.rgba.end(),
                              [](const glm::vec4& c) { return c.a > 0.1F; })
                      ? 1
                      : 0;
      for (VdiRenderer* each : {&renderer, &rendererAsGpu}) {
        const Image seen = each->render(cameras[i], 65, 47, reconstruction);
        CHECK(isView(seen, expected, reconstruction));
        CHECK(depthsThatDiffer(seen, expected, 1e-3F) <= seen.depth.size() / 100);
      }
    }
  }
  CHECK(seenFrom >= std::size(test::reconstructions) * (cameras.size() - 1));
  CHECK(deviceAsGpu()->validationMessages() == "");
}

TEST_CASE("rays that end at objects, of any part of an image plane: as in the reference") {
  const auto decomposed = test::decompose("coil", {40, 40, 40}, {1, 1, 1}, Layout::OnOneRank,
                                          Joint::SharedPoints, ScalarType::U8, 0, 1);
  const bool parallel = GENERATE(false, true);
  const Camera camera = test::oblique(parallel);
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks(decomposed.mine);
  const auto vdi = generator.generate(camera, test::threeHues(80.0), test::smallSettings(121, 83, 6));
  VdiRenderer renderer(device());
  renderer.setVdi(*vdi);
  VdiRenderer rendererAsGpu(deviceAsGpu());
  rendererAsGpu.setVdi(*vdi);
  constexpr int width = 65;
  constexpr int height = 47;
  for (const double angle : {0.0, 20.0, 160.0}) {
    const Camera other = camera.azimuth(angle);
    const View whole(other, width, height);
    const glm::dvec2 half{whole.halfWidth(), whole.halfHeight()};
    // Off-centre, and with oblong pixels.
    const View part(other, width, height,
                    ImagePlane{glm::dvec2(-0.9, -0.4) * half, glm::dvec2(0.3, 0.6) * half});
    for (const View& view : {whole, part}) {
      // A slanted wall through the middle of the scene; to its left rays go on, to its right they end at
      // once.
      const double middle = view.depthOf(vdi->bounds.center());
      const double depth = glm::length(vdi->bounds.size());
      std::vector<float> ends;
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          const double wall = middle + depth * (0.3 * x / width - 0.2 * y / height);
          ends.push_back(x < width / 4         ? Image::noDepth
                         : x > width * 15 / 16 ? 0.0F
                                               : static_cast<float>(wall));
        }
      }
      for (const Reconstruction reconstruction : test::reconstructions) {
        INFO("from " << angle << ", " << toString(reconstruction) << ", parallel " << parallel);
        const Image open = reference::render(*vdi, view, reconstruction);
        const Image expected = reference::render(*vdi, view, reconstruction, ends);
        std::size_t hidden = 0;
        std::size_t dimmed = 0;
        for (std::size_t i = 0; i < ends.size(); ++i) {
          const bool isOpen = ends[i] == Image::noDepth;
          if (isOpen) CHECK(expected.rgba[i] == open.rgba[i]);
          if (ends[i] == 0.0F) CHECK(expected.rgba[i].a == 0.0F);
          // A column that ends early blends its lists differently.
          if (reconstruction == Reconstruction::Constant) CHECK(expected.rgba[i].a <= open.rgba[i].a + 1e-5F);
          hidden += open.rgba[i].a > 0.1F && expected.rgba[i].a == 0.0F ? 1 : 0;
          dimmed += expected.rgba[i].a > 0.0F && expected.rgba[i].a < 0.9F * open.rgba[i].a ? 1 : 0;
        }
        CHECK(hidden + dimmed > 50);
        for (VdiRenderer* each : {&renderer, &rendererAsGpu}) {
          CHECK(isView(each->render(view, ends, reconstruction), expected, reconstruction));
          // It leaves no trace.
          CHECK(isView(each->render(view, {}, reconstruction), open, reconstruction));
        }
      }
    }
  }
  CHECK(deviceAsGpu()->validationMessages() == "");
}

TEST_CASE("a ray that ends within a supersegment sees the part of it in front") {
  Vdi vdi;
  vdi.camera.position = {0.0, 0.0, 0.0};
  vdi.camera.focalPoint = {0.0, 0.0, 1.0};
  vdi.camera.parallelProjection = GENERATE(false, true);
  constexpr int side = 64;
  constexpr std::size_t middle = side / 2 * side + side / 2;
  vdi.width = vdi.height = side;
  vdi.budget = 1;
  SupersegmentLists lists;
  const Supersegment segment{2.0F, 6.0F, 0.6F, 0.0F, 0.0F, 0.75F};
  lists.offsets = {0};
  for (int i = 0; i < side * side; ++i) {
    lists.segments.push_back(segment);
    lists.offsets.push_back(static_cast<std::uint32_t>(lists.segments.size()));
  }
  vdi.lists = lists;
  VdiRenderer renderer(device());
  renderer.setVdi(vdi);
  for (const float part : {0.0F, 0.25F, 0.5F, 1.0F, 2.0F}) {
    INFO(part);
    const std::vector<float> ends(side * side, 2.0F + 4.0F * part);
    const float opacity = 1.0F - std::pow(0.25F, std::min(part, 1.0F));
    for (const Image& seen : {renderer.render(vdi.view(), ends, Reconstruction::Constant),
                              reference::render(vdi, vdi.view(), Reconstruction::Constant, ends)}) {
      CHECK(seen.rgba[middle].a == Approx(opacity).margin(1e-3));
      CHECK(seen.rgba[middle].r == Approx(0.8F * opacity).margin(1e-3));
    }
  }
}

TEST_CASE("a picture of more tiles than a device has workgroups side by side") {
  const auto decomposed = test::decompose("ramp", {8, 8, 8}, {1, 1, 1}, Layout::OnOneRank,
                                          Joint::SharedPoints, ScalarType::F32, 0, 1);
  Camera camera = test::oblique(true);
  camera.parallelScale = 0.1;  // the volume surrounds the camera
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks(decomposed.mine);
  const auto vdi = generator.generate(camera, test::threeHues(2.0), test::smallSettings(16, 16, 4));
  VdiRenderer renderer(device());
  renderer.setVdi(*vdi);
  constexpr int side = 2064;  // 258 x 258 tiles; every device allows 65535 workgroups
  const Image seen = renderer.render(camera, side, side, Reconstruction::Constant);
  const Image lists = flatten(*vdi);
  float worst = 0.0F;
  float clearest = 1.0F;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const auto at = [](int column, int row, int width) {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
               static_cast<std::size_t>(column);
      };
      const glm::vec4 difference =
          seen.rgba[at(x, y, side)] - lists.rgba[at(x * 16 / side, y * 16 / side, 16)];
      for (int c = 0; c < 4; ++c) worst = std::max(worst, std::abs(difference[c]));
      clearest = std::min(clearest, seen.rgba[at(x, y, side)].a);
    }
  }
  CHECK(255.0F * worst < 2.0F);
  CHECK(clearest > 0.01F);
}

TEST_CASE("merging and compositing on the device equal the reference") {
  const auto decomposed = test::decompose("turbulence", {26, 22, 24}, {3, 3, 3}, Layout::Random,
                                          Joint::SharedPoints, ScalarType::F32, 0, 1);
  const TransferFunction function = test::threeHues(0.8);
  const Algorithm algorithm = GENERATE(from_range(std::begin(algorithms), std::end(algorithms)));
  INFO(toString(algorithm));
  GenerateSettings settings = test::smallSettings(40, 30, 6);
  settings.algorithm = algorithm;
  const Scene scene = localScene(decomposed.all);
  const reference::Frame frame(scene, test::oblique(), function, settings);
  std::vector<SupersegmentLists> subLists;
  for (std::size_t rank = 0; rank < 3; ++rank) {
    std::vector<Block> mine;
    for (std::size_t i = rank; i < decomposed.all.size(); i += 3) mine.push_back(decomposed.all[i]);
    subLists.push_back(reference::generate(frame, mine, true));
  }
  const SupersegmentLists expected = reference::composite(subLists, settings, frame.lattice.step);
  detail::Compositor compositor(device());
  const SupersegmentLists result =
      test::composite(device(), compositor, subLists, {6, 6, frame.lattice.step, algorithm, {}});
  CHECK(listsThatDiffer(result, expected) <= expected.listCount() / 50);
  // Device and host flatten interleaved lists to the picture of the composited ones.
  detail::DeviceLists merged;
  const test::HostSubLists parts(device(), subLists);
  compositor.interleave(parts.parts(), {}, merged);
  gpu::Buffer colors;
  gpu::Buffer depths;
  compositor.flatten(merged, {}, colors, depths);
  compositor.finish();
  gpu::Buffer seen(device(), result.listCount() * 20, gpu::MemoryKind::Readback);
  gpu::Commands commands(device());
  commands.begin();
  commands.copy(colors, 0, seen, 0, result.listCount() * 16);
  commands.copy(depths, 0, seen, result.listCount() * 16, result.listCount() * 4);
  commands.submitAndWait();
  for (std::size_t i = 0; i < result.listCount(); ++i) {
    CHECK(result.countOf(i) <= 6);
    glm::vec4 sum(0.0F);
    for (const Supersegment& s : result.list(i))
      sum += (1.0F - sum.a) * glm::vec4(s.red, s.green, s.blue, s.opacity);
    const glm::vec4 flat = seen.mappedAs<glm::vec4>()[i];
    for (int c = 0; c < 4; ++c) CHECK(std::abs(sum[c] - flat[c]) < 0.5F / 255.0F);
    const float front = result.countOf(i) > 0 ? result.list(i).front().front : Image::noDepth;
    const float depth = seen.mappedAs<float>()[result.listCount() * 4 + i];
    CHECK((depth == front || std::abs(depth - front) < 1e-5F));
  }
  // Codes in, codes out, compared with the reference for the codes' values.
  const DepthCode code = depthCodeFor(frame.lattice);
  std::vector<CompactLists> subCodes;
  std::vector<SupersegmentLists> subValues;
  for (const SupersegmentLists& sub : subLists) {
    subCodes.push_back(reference::compacted(sub, code));
    subValues.push_back(expanded(subCodes.back(), code));
  }
  const SupersegmentLists ofCodes = reference::composite(subValues, settings, frame.lattice.step);
  const CompactLists codes =
      test::composite(device(), compositor, subCodes, {6, 6, frame.lattice.step, algorithm, code});
  CHECK(listsThatDiffer(expanded(codes, code), expanded(reference::compacted(ofCodes, code), code),
                        oneCode) <= expected.listCount() / 25);
  CHECK(device()->validationMessages() == "");
}

TEST_CASE("ranks that agree on one tolerance: each one's lists are those of the reference") {
  // Many small blocks assigned at random: lists with many runs, some with more than the counted lists around
  // them.
  const auto blocks = GENERATE(glm::ivec3(3, 3, 3), glm::ivec3(9, 8, 9));
  const std::uint32_t supersegments = GENERATE(3U, 8U, 200U);
  INFO(blocks.x << " blocks across, " << supersegments << " supersegments");
  const auto decomposed = test::decompose("turbulence", {40, 36, 40}, blocks, Layout::Random,
                                          Joint::SharedPoints, ScalarType::F32, 0, 1);
  const TransferFunction function = test::threeHues(0.8);
  GenerateSettings settings = test::smallSettings(61, 43, supersegments);
  settings.samplesPerVoxel = supersegments == 200 ? 8.0 : 1.0;
  settings.precision = Precision::Full;
  const Scene scene = localScene(decomposed.all);
  const reference::Frame frame(scene, test::oblique(), function, settings);
  constexpr std::size_t ranks = 3;
  std::vector<std::vector<Block>> blocksOf(ranks);
  const std::vector<Block> all = withLayers(decomposed.all);
  for (std::size_t i = 0; i < all.size(); ++i) blocksOf[i * 7 % ranks].push_back(all[i]);
  const std::vector<SupersegmentLists> expected = reference::generateTogether(frame, blocksOf);

  // Each rank's ray caster, and the sum as ranks would compute it.
  const bool asGpu = GENERATE(false, true);
  if (asGpu && supersegments != 8) return;  // compiling takes too long
  const auto own = asGpu ? deviceAsGpu() : device();
  std::vector<std::unique_ptr<detail::RayCaster>> casters;
  std::vector<detail::RayCaster::Cast> casts;
  std::vector<std::uint8_t> sum;
  const detail::RayCaster::Request request{scene,    frame.view, frame.lattice, frame.table,
                                           settings, true,       false,         {}};
  for (std::size_t r = 0; r < ranks; ++r) {
    casters.push_back(std::make_unique<detail::RayCaster>(own, 0));
    casters.back()->volume().setBlocks(blocksOf[r], scene);
    casts.push_back(casters.back()->begin(request));
    const std::uint64_t bytes = detail::RayCaster::levelBytes(casts.back());
    detail::HostAccess memory(own, HostMemory::anonymous(bytes));
    casters.back()->countLevels(casts.back(), memory, 0);
    sum.resize(bytes, 0);
    for (std::size_t i = 0; i < bytes; ++i) {
      sum[i] = static_cast<std::uint8_t>(
          std::min(sum[i] + std::to_integer<int>(memory.memory()->bytes()[i]), 255));
    }
  }
  detail::HostAccess memory(own, HostMemory::anonymous(sum.size()));
  std::memcpy(memory.memory()->bytes().data(), sum.data(), sum.size());
  const detail::RayCaster::LevelSum stretch{&memory, 0, 0, sum.size()};
  std::size_t supersegmentsInAll = 0;
  std::vector<std::vector<std::uint32_t>> weights;
  for (std::size_t r = 0; r < ranks; ++r) {
    casters[r]->agree(casts[r], std::span(&stretch, 1));
    detail::DeviceLists lists;
    casters[r]->makeBand(casts[r], 0, 43, lists);
    weights.push_back(casters[r]->agreedWeights(casts[r]));
    const SupersegmentLists made = test::download<Supersegment>(own, lists);
    CHECK(listsThatDiffer(made, expected[r]) <= made.listCount() / 40);
    supersegmentsInAll += made.segments.size();
  }
  CHECK(weights[1] == weights[0]);  // otherwise ranks would disagree on the owners of lists
  CHECK(weights[2] == weights[0]);
  std::uint64_t weight = 0;
  for (const std::uint32_t w : weights[0]) weight += w;
  CHECK(static_cast<double>(weight) > 0.5 * static_cast<double>(supersegmentsInAll));
  CHECK(own->validationMessages() == "");
}

TEST_CASE("a total budget: as in the reference, the wanted total, unequal lists") {
  const double fill = GENERATE(1.0, 0.5);
  INFO("fill " << fill);
  const auto decomposed = test::decompose("turbulence", {40, 40, 40}, {2, 2, 2}, Layout::Random,
                                          Joint::SharedPoints, ScalarType::F32, 0, 1);
  const TransferFunction function = test::threeHues(0.8);
  GenerateSettings settings = test::smallSettings(61, 43, 5);
  settings.precision = Precision::Full;
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks(decomposed.mine);
  const auto equal = generator.generate(test::oblique(), function, settings);
  settings.budget = Budget::Total;
  settings.fill = fill;
  const auto vdi = generator.generate(test::oblique(), function, settings);
  CHECK_NOTHROW(validate(*vdi));
  const reference::Frame frame(generator.scene(), test::oblique(), function, settings);
  const SupersegmentLists expected = reference::generate(frame, withLayers(decomposed.mine), false);
  CHECK(listsThatDiffer(vdi->expandedLists(), expected) <= expected.listCount() / 50);
  CHECK(largestDifference(flatten(*vdi), reference::renderVolume(frame, withLayers(decomposed.mine))) < 1.0F);
  const double share =
      static_cast<double>(vdi->supersegmentCount()) / static_cast<double>(equal->supersegmentCount());
  CHECK(share == Approx(fill).epsilon(0.05));
  std::size_t longest = 0;
  for (std::size_t i = 0; i < expected.listCount(); ++i) longest = std::max(longest, expected.list(i).size());
  CHECK(static_cast<double>(longest) > 5 * fill);
  CHECK(longest <= 10);

  // Composites three ranks' lists.
  settings.budget = Budget::List;
  settings.fill = 1.0;
  const reference::Frame equalFrame(generator.scene(), test::oblique(), function, settings);
  std::vector<SupersegmentLists> subLists;
  for (std::size_t rank = 0; rank < 3; ++rank) {
    std::vector<Block> mine;
    for (std::size_t i = rank; i < decomposed.all.size(); i += 3) mine.push_back(decomposed.all[i]);
    subLists.push_back(reference::generate(equalFrame, mine, true));
  }
  settings.budget = Budget::Total;
  settings.fill = fill;
  const SupersegmentLists composited = reference::composite(subLists, settings, frame.lattice.step);
  detail::Compositor compositor(device());
  detail::Compositor::Request request{
      5, maxPerList(5, Budget::Total), frame.lattice.step, Algorithm::Merge, {}};
  detail::DeviceLists merged;
  const test::HostSubLists parts(device(), subLists);
  compositor.interleave(parts.parts(), {}, merged);
  request.level = compositor.histogram(merged, request).levelFor(fill);
  CHECK(listsThatDiffer(test::composite(device(), compositor, subLists, request), composited) <=
        composited.listCount() / 50);
}

TEST_CASE("programs for GPUs give the same lists as those for CPUs") {
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
  const auto decomposed = test::decompose("mixing", {48, 48, 48}, {2, 2, 2}, Layout::OnOneRank,
                                          Joint::SharedPoints, ScalarType::F32, 0, 1);
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
    const ImageDifference difference = differenceOf(renderer.render(other, 128, 96), *truth);
    CHECK(difference.ssim >= minimum);
    if (angle == 0.0) CHECK(difference.meanError < 0.5);
  }
}

TEST_CASE("VDIs set before the last one's upload has ended are rendered whole") {
  VdiGenerator generator(device(), comm::Communicator::serial());
  const Camera camera = test::oblique();
  std::vector<Vdi> vdis;
  for (const char* field : {"mixing", "sphere", "turbulence"}) {
    const auto decomposed = test::decompose(field, {32, 32, 32}, {1, 1, 1}, Layout::OnOneRank,
                                            Joint::SharedPoints, ScalarType::F32, 0, 1);
    generator.setBlocks(decomposed.mine);
    GenerateSettings settings = test::smallSettings(96 + 32 * static_cast<int>(vdis.size()), 80, 10);
    settings.precision = vdis.size() == 1 ? Precision::Full : Precision::Compact;
    vdis.push_back(*generator.generate(camera, test::threeHues(1.0), settings));
  }
  VdiRenderer busy(device());
  for (const Vdi& last : vdis) {
    VdiRenderer fresh(device());
    fresh.setVdi(last);
    for (const Vdi& vdi : vdis) busy.setVdi(vdi);
    busy.setVdi(last);
    CHECK(largestDifference(busy.render(camera.azimuth(15.0), 96, 80),
                            fresh.render(camera.azimuth(15.0), 96, 80)) == 0.0F);
  }
  VdiRenderer ended(device());
  ended.setVdi(vdis.front());  // without a render: its destructor waits
  CHECK(device()->validationMessages() == "");
}

TEST_CASE("frames of the same size reuse everything") {
  const auto decomposed = test::decompose("shells", {20, 20, 20}, {2, 2, 2}, Layout::OnOneRank,
                                          Joint::SharedPoints, ScalarType::F32, 0, 1);
  const GenerateSettings settings = test::smallSettings();
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks(decomposed.mine);
  const auto first = generator.generate(test::oblique(), test::threeHues(1.0), settings);
  const std::uint64_t held = device()->allocatedBytes();
  for (int i = 0; i < 3; ++i) {
    generator.setBlocks(decomposed.mine);
    const auto again = generator.generate(test::oblique(), test::threeHues(1.0), settings);
    CHECK(*again == *first);
    CHECK(device()->allocatedBytes() == held);
  }
}

TEST_CASE("thousands of small blocks in one pass") {
  const auto decomposed = test::decompose("turbulence", {61, 61, 61}, {15, 15, 15}, Layout::OnOneRank,
                                          Joint::SharedPoints, ScalarType::U8, 0, 1);
  CHECK(decomposed.mine.size() == 3375);
  const auto whole = test::decompose("turbulence", {61, 61, 61}, {1, 1, 1}, Layout::OnOneRank,
                                     Joint::SharedPoints, ScalarType::U8, 0, 1);
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
  const auto whole = test::decompose("turbulence", {40, 40, 40}, {1, 1, 1}, Layout::OnOneRank,
                                     Joint::SharedPoints, ScalarType::F32, 0, 1);
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
