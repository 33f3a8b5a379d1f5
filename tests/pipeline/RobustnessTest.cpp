// Bad and strange input: a clear error or a right picture.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "tests/Scenes.h"
#include "vdi/core/Error.h"
#include "vdi/pipeline/Pipeline.h"

using namespace vdi;
using apps::Joint;
using apps::Layout;

namespace {

std::shared_ptr<gpu::Device> device() {
  static const std::shared_ptr<gpu::Device> instance = gpu::Device::create(gpu::requestFromEnvironment(0));
  return instance;
}

Block cube(int n, double spacing, const std::function<float(const glm::ivec3&)>& value) {
  const apps::Lattice lattice{glm::ivec3(n), glm::dvec3(0.0), glm::dvec3(spacing), ScalarType::F32,
                              Joint::SharedPoints};
  return apps::makeBlock(lattice, {{0, 0, 0}, glm::ivec3(n), 0}, value);
}

float highestOpacity(const Image& image) {
  float highest = 0.0F;
  for (const glm::vec4& p : image.rgba) {
    REQUIRE(std::isfinite(p.a));
    highest = std::max(highest, p.a);
  }
  return highest;
}

ErrorCode codeOf(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    CHECK(std::string(error.what()).size() > 10);
    return error.code();
  }
  FAIL("nothing was thrown");
  return ErrorCode::Io;
}

}  // namespace

TEST_CASE("NaN and infinite scalars are transparent, the rest is shown") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  VdiGenerator generator(device(), comm::Communicator::serial());
  const Block half = cube(16, 1.0 / 15.0, [&](const glm::ivec3& i) {
    return i.x < 8 ? (i.y < 8 ? nan : i.z < 8 ? infinity : -infinity) : 0.9F;
  });
  generator.setBlocks({half});
  CHECK(generator.scalarRange().max == Approx(0.9));
  const GenerateSettings settings = test::smallSettings();
  const Camera front = Camera::framing({glm::dvec3(0.0), glm::dvec3(1.0)}, {0.0, 0.0, -1.0}, {0.0, 1.0, 0.0});
  const auto vdi = generator.generate(front, test::threeHues(1.0), settings);
  CHECK_NOTHROW(validate(*vdi));
  const Image image = flatten(*vdi);
  CHECK(highestOpacity(image) > 0.9F);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width / 2 - 2; ++x) {
      CHECK(image.rgba[static_cast<std::size_t>(y * image.width + x)].a == 0.0F);
    }
  }
}

TEST_CASE("cameras inside, behind and looking away") {
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks({cube(16, 1.0 / 15.0, [](const glm::ivec3&) { return 0.7F; })});
  const GenerateSettings settings = test::smallSettings();
  Camera camera;
  camera.position = glm::dvec3(0.5);
  camera.focalPoint = {0.5, 0.5, -1.0};
  const auto inside = generator.generate(camera, test::threeHues(1.0), settings);
  CHECK_NOTHROW(validate(*inside));
  CHECK(highestOpacity(flatten(*inside)) > 0.5F);
  VdiRenderer renderer(device());
  renderer.setVdi(*inside);
  for (const glm::dvec3& position :
       {glm::dvec3(0.5, 0.5, 0.3), glm::dvec3(0.4, 0.6, -3.0), glm::dvec3(0.5, 0.5, 9.0)}) {
    Camera other;
    other.position = position;
    other.focalPoint = {0.5, 0.5, 0.25};
    CHECK(highestOpacity(renderer.render(other, 32, 24)) > 0.1F);
  }
  Camera away = camera;
  away.position = {0.5, 0.5, -3.0};
  away.focalPoint = {0.5, 0.5, -4.0};
  const auto nothing = generator.generate(away, test::threeHues(1.0), settings);
  CHECK(nothing->supersegmentCount() == 0);
  CHECK(highestOpacity(*generator.renderVolume(away, test::threeHues(1.0), settings)) == 0.0F);
  renderer.setVdi(*nothing);
  CHECK(highestOpacity(renderer.render(away, 8, 8)) == 0.0F);
}

TEST_CASE("no blocks, empty blocks, a transparent function, one supersegment, constant data") {
  VdiGenerator generator(device(), comm::Communicator::serial());
  const GenerateSettings settings = test::smallSettings();
  generator.setBlocks({});
  CHECK(generator.generate(test::oblique(), test::threeHues(1.0), settings)->supersegmentCount() == 0);

  Block flat = cube(8, 1.0 / 7.0, [](const glm::ivec3&) { return 0.7F; });
  flat.owned.hi.x = flat.owned.lo.x;
  generator.setBlocks({flat});
  CHECK(generator.generate(test::oblique(), test::threeHues(1.0), settings)->supersegmentCount() == 0);

  generator.setBlocks({cube(8, 1.0 / 7.0, [](const glm::ivec3&) { return 0.7F; })});
  TransferFunction transparent = test::threeHues(1.0);
  for (OpacityNode& node : transparent.opacities) node.opacity = 0.0;
  CHECK(generator.generate(test::oblique(), transparent, settings)->supersegmentCount() == 0);

  const auto single =
      generator.generate(test::oblique(), test::threeHues(1.0), test::smallSettings(64, 48, 1));
  CHECK_NOTHROW(validate(*single));
  CHECK(highestOpacity(flatten(*single)) > 0.5F);
}

TEST_CASE("scales of 1e-9 and 1e9 give the picture of scale 1") {
  const auto value = [](const glm::ivec3& i) {
    return static_cast<float>((i.x * 7 + i.y * 3 + i.z * 5) % 11) / 11.0F;
  };
  const GenerateSettings settings = test::smallSettings();
  Image unit;
  std::size_t segments = 0;
  for (const double scale : {1.0, 1e-9, 1e9}) {
    INFO(scale);
    VdiGenerator generator(device(), comm::Communicator::serial());
    generator.setBlocks({cube(12, scale / 11.0, value)});
    const Camera camera =
        Camera::framing({glm::dvec3(0.0), glm::dvec3(scale)}, {-0.5, -0.35, -1.0}, {0.0, 1.0, 0.0});
    const auto vdi = generator.generate(camera, test::threeHues(1.0, 0.05 * scale), settings);
    CHECK_NOTHROW(validate(*vdi));
    const Image image = flatten(*vdi);
    if (scale == 1.0) {
      unit = image;
      segments = vdi->supersegmentCount();
      CHECK(highestOpacity(image) > 0.5F);
      continue;
    }
    CHECK(std::abs(static_cast<double>(vdi->supersegmentCount()) / static_cast<double>(segments) - 1.0) <
          0.01);
    for (std::size_t i = 0; i < image.rgba.size(); ++i) {
      CHECK(glm::length(image.rgba[i] - unit.rgba[i]) < 2.0F / 255.0F);
    }
  }
}

TEST_CASE("wrong arguments are refused with their names") {
  VdiGenerator generator(device(), comm::Communicator::serial());
  const Block good = cube(8, 1.0 / 7.0, [](const glm::ivec3&) { return 0.7F; });
  Block zeroSpacing = good;
  zeroSpacing.spacing.y = 0.0;
  CHECK(codeOf([&] { generator.setBlocks({zeroSpacing}); }) == ErrorCode::InvalidArgument);
  Block noData = good;
  noData.data = nullptr;
  CHECK(codeOf([&] { generator.setBlocks({noData}); }) == ErrorCode::InvalidArgument);
  Block overlapping = good;
  overlapping.owned.lo += 0.3;
  CHECK(codeOf([&] { generator.setBlocks({good, overlapping}, false); }) == ErrorCode::InvalidArgument);

  generator.setBlocks({good});
  const auto withSettings = [&](auto change) {
    GenerateSettings settings = test::smallSettings();
    change(settings);
    return codeOf([&] { generator.generate(test::oblique(), test::threeHues(1.0), settings); });
  };
  CHECK(withSettings([](GenerateSettings& s) { s.supersegments = 0; }) == ErrorCode::InvalidArgument);
  CHECK(withSettings([](GenerateSettings& s) { s.width = 0; }) == ErrorCode::InvalidArgument);
  CHECK(withSettings([](GenerateSettings& s) { s.samplesPerVoxel = -1.0; }) == ErrorCode::InvalidArgument);
  CHECK(withSettings([](GenerateSettings& s) { s.terminationOpacity = 0.0; }) == ErrorCode::InvalidArgument);
  Camera onTheSpot = test::oblique();
  onTheSpot.focalPoint = onTheSpot.position;
  CHECK(codeOf([&] { generator.generate(onTheSpot, test::threeHues(1.0), test::smallSettings()); }) ==
        ErrorCode::InvalidArgument);
  TransferFunction empty;
  CHECK(codeOf([&] { generator.generate(test::oblique(), empty, test::smallSettings()); }) ==
        ErrorCode::InvalidArgument);
  // After all that it still works.
  CHECK(
      generator.generate(test::oblique(), test::threeHues(1.0), test::smallSettings())->supersegmentCount() >
      0);
}
