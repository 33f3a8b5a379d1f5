// Bad and unusual input: a clear error or a right picture.
#include <cmath>
#include <limits>

#include "tests/Catch.h"
#include "tests/Devices.h"
#include "tests/Scenes.h"
#include "tests/Thrown.h"
#include "vdi/core/Error.h"
#include "vdi/core/Flatten.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vdi/pipeline/VdiRenderer.h"
#include "vdi/reference/Reference.h"

using namespace vdi;
using synthetic::Joint;
using test::device;

namespace {

Block cube(int n, double spacing, const std::function<float(const glm::ivec3&)>& value) {
  const synthetic::Lattice lattice{glm::ivec3(n), glm::dvec3(0.0), glm::dvec3(spacing), ScalarType::F32,
                                   Joint::SharedPoints};
  return synthetic::makeBlock(lattice, {{0, 0, 0}, glm::ivec3(n), 0}, value);
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
  const Error error = test::errorOf(call);
  CHECK(std::string(error.what()).size() > 10);
  return error.code();
}

}  // namespace

TEST_CASE("a box filled with one value: its picture doesn't depend on where samples lie") {
  VdiGenerator generator(device(), comm::Communicator::serial());
  std::vector<Block> blocks;
  blocks.push_back(cube(5, 0.25, [](const glm::ivec3&) { return 0.6F; }));
  generator.setBlocks(std::move(blocks));
  GenerateSettings settings = test::smallSettings(120, 90);
  const auto coarse = generator.renderVolume(test::oblique(), test::threeHues(1.0), settings);
  settings.samplesPerVoxel = 16.0;
  const auto fine = generator.renderVolume(test::oblique(), test::threeHues(1.0), settings);
  CHECK(highestOpacity(*coarse) > 0.9F);
  float worst = 0.0F;
  for (std::size_t i = 0; i < coarse->pixelCount(); ++i)
    worst = std::max(worst, std::abs(coarse->rgba[i].a - fine->rgba[i].a));
  CHECK(worst < 1.0F / 255.0F);
}

TEST_CASE("NaN is transparent, infinite scalars are beyond the transfer function's ends, the rest is shown",
          "[pictures]") {
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
  const auto at = [](const Image& picture, double x, double y) {
    const int column = static_cast<int>(x * picture.width);
    const int row = static_cast<int>(y * picture.height);
    return picture.rgba[static_cast<std::size_t>(row * picture.width + column)];
  };
  for (int y = 0; y < image.height / 2 - 3; ++y) {
    for (int x = 0; x < image.width / 2 - 2; ++x)
      CHECK(image.rgba[static_cast<std::size_t>(y * image.width + x)].a == 0.0F);
  }
  // threeHues is transparent below a third: rays pass the negatively infinite values and show the positively
  // infinite ones.
  CHECK(at(image, 0.4, 0.7).a > 0.9F);
  CHECK(at(image, 0.4, 0.7).r > 4.0F * at(image, 0.4, 0.7).b);
  // Ends of a function that is visible from end to end, and of one whose range is far from the values.
  for (const double scale : {1.0, 1e-20}) {
    INFO(scale);
    TransferFunction function{{{0.0, {0, 0, 1}}, {scale, {1, 0, 0}}}, {{0.0, 0.7}, {scale, 0.9}}, 0.05};
    for (const double rate : {0.25, 1.0, 3.0}) {  // points and slabs
      INFO(rate);
      GenerateSettings own = settings;
      own.samplesPerVoxel = rate;
      for (const double side : {-1.0, 1.0}) {
        const Camera camera =
            Camera::framing({glm::dvec3(0.0), glm::dvec3(1.0)}, {0.0, 0.0, side}, {0.0, 1.0, 0.0});
        const Image seen = *generator.renderVolume(camera, function, own);
        const reference::RayInputs inputs(generator.scene(), camera, function, own);
        const Image expected = reference::renderVolume(inputs, {&half, 1});
        float worst = 0.0F;
        for (std::size_t i = 0; i < seen.rgba.size(); ++i) {
          const glm::vec4 apart = glm::abs(seen.rgba[i] - expected.rgba[i]);
          worst = std::max({worst, apart.r, apart.g, apart.b, apart.a});
        }
        CHECK(worst < 2.0F / 255.0F);
        const double left = side < 0.0 ? 0.4 : 0.6;
        CHECK(at(seen, left, 0.3).a == 0.0F);  // NaN
        const glm::vec4 nearer = at(seen, left, 0.7);
        CHECK(nearer.a > 0.99F);
        CHECK((side < 0.0 ? nearer.b : nearer.r) > 0.95F);
      }
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

TEST_CASE("scales of 1e-9, 1e9 and 1e21 give the picture of scale 1", "[pictures]") {
  const auto value = [](const glm::ivec3& i) {
    return static_cast<float>((i.x * 7 + i.y * 3 + i.z * 5) % 11) / 11.0F;
  };
  const GenerateSettings settings = test::smallSettings();
  Image unit;
  std::size_t segments = 0;
  for (const double scale : {1.0, 1e-9, 1e9, 1e21}) {
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

namespace {

/// For all algorithms, budgets and precisions: lists stay within the budget, and V_O shows the volume's own
/// picture. From the side, the picture has the same amount of light, to a few per cent.
void requireFaithful(VdiGenerator& generator, const Camera& camera, const TransferFunction& function,
                     GenerateSettings settings) {
  const auto volume = generator.renderVolume(camera, function, settings);
  const auto side = generator.renderVolume(camera.azimuth(20.0), function, settings);
  CHECK(highestOpacity(*volume) > 0.2F);
  const std::pair<Algorithm, Budget> kinds[] = {{Algorithm::Merge, Budget::List},
                                                {Algorithm::Merge, Budget::Total},
                                                {Algorithm::Bisection, Budget::List}};
  for (const auto& [algorithm, budget] : kinds) {
    for (const Precision precision : {Precision::Compact, Precision::Full}) {
      INFO(toString(algorithm) << ", " << toString(budget) << ", " << toString(precision));
      settings.algorithm = algorithm;
      settings.budget = budget;
      settings.precision = precision;
      const auto vdi = generator.generate(camera, function, settings);
      CHECK_NOTHROW(validate(*vdi));
      const Image flat = flatten(*vdi);
      float worst = 0.0F;
      for (std::size_t i = 0; i < flat.rgba.size(); ++i) {
        for (int c = 0; c < 4; ++c) worst = std::max(worst, std::abs(flat.rgba[i][c] - volume->rgba[i][c]));
      }
      CHECK(worst < 1.0F / 255.0F);
      VdiRenderer renderer(device());
      renderer.setVdi(*vdi);
      const Image seen = renderer.render(camera.azimuth(20.0), settings.width, settings.height);
      glm::vec4 light(0.0F);
      glm::vec4 expected(0.0F);
      for (std::size_t i = 0; i < seen.rgba.size(); ++i) {
        light += seen.rgba[i];
        expected += side->rgba[i];
      }
      CHECK(light.a == Approx(expected.a).epsilon(0.15));
    }
  }
}

/// Opaque in one narrow band of scalars.
TransferFunction band(double center, double halfWidth) {
  TransferFunction function;
  function.colors = {{0.0, {0.9, 0.6, 0.1}}};
  function.opacities = {{center - halfWidth, 0.0},
                        {center - 0.9 * halfWidth, 0.9},
                        {center + 0.9 * halfWidth, 0.9},
                        {center + halfWidth, 0.0}};
  function.unitDistance = 0.05;
  return function;
}

}  // namespace

TEST_CASE("many bands, one narrow band, constant data, one opaque voxel: V_O's picture is the volume's",
          "[pictures]") {
  VdiGenerator generator(device(), comm::Communicator::serial());
  const GenerateSettings settings = test::smallSettings(64, 48, 6);
  generator.setBlocks({cube(
      24, 1.0 / 23.0, [](const glm::ivec3& i) { return static_cast<float>(i.x + i.y + i.z) / 69.0F; })});
  TransferFunction bands;
  bands.colors = {{0.0, {0.9, 0.1, 0.1}}, {1.0, {0.1, 0.1, 0.9}}};
  for (int i = 0; i < 20; ++i) {
    bands.opacities.push_back({i / 20.0, 0.0});
    bands.opacities.push_back({(i + 0.5) / 20.0, 0.3});
  }
  bands.unitDistance = 0.05;
  requireFaithful(generator, test::oblique(), bands, settings);
  // A band as wide as the step between two voxels.
  requireFaithful(generator, test::oblique(), band(0.5, 0.5 / 69.0), settings);

  generator.setBlocks({cube(16, 1.0 / 15.0, [](const glm::ivec3&) { return 0.7F; })});
  requireFaithful(generator, test::oblique(), test::threeHues(1.0), settings);

  generator.setBlocks(
      {cube(17, 1.0 / 16.0, [](const glm::ivec3& i) { return i == glm::ivec3(8) ? 1.0F : 0.0F; })});
  // At one sample per voxel, volume rendering itself may miss the opaque voxel from the side.
  GenerateSettings fine = test::smallSettings(160, 120, 6);
  fine.samplesPerVoxel = 4.0;
  requireFaithful(generator, test::oblique(), band(1.0, 0.8), fine);
}

TEST_CASE("voxels 50 times as long as wide", "[pictures]") {
  const synthetic::Lattice lattice{
      {40, 40, 5}, glm::dvec3(0.0), {0.01, 0.01, 0.5}, ScalarType::F32, Joint::SharedPoints};
  const Block block = synthetic::makeBlock(lattice, {{0, 0, 0}, {40, 40, 5}, 0}, [](const glm::ivec3& i) {
    return 0.5F + 0.5F * std::sin(0.3F * static_cast<float>(i.x)) * std::cos(static_cast<float>(i.z));
  });
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks({block});
  const Camera camera =
      Camera::framing({glm::dvec3(0.0), glm::dvec3(0.39, 0.39, 2.0)}, {-1.0, -0.4, -0.5}, {0.0, 1.0, 0.0});
  requireFaithful(generator, camera, test::threeHues(1.0), test::smallSettings(64, 48, 10));
}

TEST_CASE("one supersegment a list and 255, pictures of one pixel and of one row", "[pictures]") {
  const auto decomposed = test::onOneRank("turbulence", {30, 30, 30}, {2, 2, 2}, ScalarType::U8);
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks(decomposed.mine);
  const TransferFunction function = test::threeHues(80.0);
  for (const std::uint32_t budget : {1U, 255U}) {
    INFO(budget);
    requireFaithful(generator, test::oblique(), function, test::smallSettings(48, 36, budget));
  }
  for (const auto& [width, height] : {std::pair(1, 1), std::pair(5, 1), std::pair(1, 7)}) {
    INFO(width << " x " << height);
    const auto vdi = generator.generate(test::oblique(), function, test::smallSettings(width, height));
    CHECK_NOTHROW(validate(*vdi));
    CHECK(highestOpacity(flatten(*vdi)) > 0.2F);
  }
}

TEST_CASE("rays of more samples than depth codes can tell apart give a VDI of full precision") {
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks({cube(8, 1.0 / 7.0, [](const glm::ivec3&) { return 0.7F; })});
  GenerateSettings settings = test::smallSettings(8, 6, 4);
  settings.samplesPerVoxel = 1.0;
  CHECK(generator.generate(test::oblique(), test::threeHues(1.0), settings)->precision() ==
        Precision::Compact);
  const synthetic::Lattice lattice{
      {2, 2, 200}, glm::dvec3(0.0), {0.0005, 0.0005, 0.05}, ScalarType::F32, Joint::SharedPoints};
  generator.setBlocks(
      {synthetic::makeBlock(lattice, {{0, 0, 0}, {2, 2, 200}, 0}, [](const glm::ivec3&) { return 0.7F; })});
  const Camera along =
      Camera::framing({glm::dvec3(0.0), glm::dvec3(0.0005, 0.0005, 10.0)}, {0.1, 0.2, -1.0}, {0.0, 1.0, 0.0});
  const auto vdi = generator.generate(along, test::threeHues(1.0), settings);
  CHECK(vdi->precision() == Precision::Full);
  CHECK_NOTHROW(validate(*vdi));
}

TEST_CASE("values beyond single precision: a right picture or an error", "[pictures]") {
  VdiGenerator generator(device(), comm::Communicator::serial());
  const auto blockOf = [](ScalarType type, double scale, double spacing = 1.0, double origin = 0.0) {
    const synthetic::Lattice lattice{glm::ivec3(8), glm::dvec3(origin), glm::dvec3(spacing), type,
                                     Joint::SharedPoints};
    return synthetic::makeBlock(lattice, {{0, 0, 0}, glm::ivec3(8), 0},
                                [scale](const glm::ivec3& i) { return scale * (1 + i.x) / 8.0; });
  };
  const auto shown = [&](const Block& block, double scale) {
    generator.setBlocks({block});
    TransferFunction function = test::threeHues(scale, 0.05 * block.owned.size().x);
    const Camera camera = Camera::framing(block.owned, {-0.5, -0.35, -1.0}, {0.0, 1.0, 0.0});
    return highestOpacity(*generator.renderVolume(camera, function, test::smallSettings(16, 12))) > 0.9F;
  };
  for (const double scale : {1e-28, 1e30}) CHECK(shown(blockOf(ScalarType::F32, scale), scale));
  for (const double scale : {1e-280, 1e-40, 1e40, 1e290})
    CHECK(shown(blockOf(ScalarType::F64, scale), scale));
  for (const double spacing : {1e-29, 1e29}) CHECK(shown(blockOf(ScalarType::F32, 1.0, spacing), 1.0));
  CHECK(shown(blockOf(ScalarType::F32, 1.0, 1.0, 1e11), 1.0));

  const auto refused = [&](const Block& block, const char* word) {
    try {
      generator.setBlocks({block});
    } catch (const Error& error) {
      CHECK_THAT(error.what(), vdi::test::ContainsSubstring(word));
      return error.code() == ErrorCode::InvalidArgument;
    }
    return false;
  };
  for (const double scale : {1e-31, 1e-40, 1e-44})
    CHECK(refused(blockOf(ScalarType::F32, scale), "too small"));
  for (const double scale : {1e-304, 1e-310}) CHECK(refused(blockOf(ScalarType::F64, scale), "too small"));
  CHECK(refused(blockOf(ScalarType::F64, 1e308), "1e+300"));
  for (const double spacing : {1e-31, 1e-40, 1e31})
    CHECK(refused(blockOf(ScalarType::F32, 1.0, spacing), "spacing must be"));
  for (const double origin : {1e13, 1e15})
    CHECK(refused(blockOf(ScalarType::F32, 1.0, 1.0, origin), "spacings from"));
  // Tiny values next to larger ones count as 0, and data of only zeros are legal.
  CHECK_NOTHROW(generator.setBlocks({blockOf(ScalarType::F32, 0.0)}));
  Block beside = blockOf(ScalarType::F32, 1e-40);
  beside.origin.x += 7.0;
  beside.owned.lo.x += 7.0;
  beside.owned.hi.x += 7.0;
  CHECK_NOTHROW(generator.setBlocks({blockOf(ScalarType::F32, 1.0), beside}));
  // A fill value far beyond the other values.
  std::vector<double> filled(512, 0.5);
  filled[100] = 1e36;
  Block block = blockOf(ScalarType::F64, 1.0);
  block.data = filled.data();
  generator.setBlocks({block});
  CHECK(codeOf([&] {
          generator.renderVolume(test::oblique(), test::threeHues(1.0), test::smallSettings(16, 12));
        }) == ErrorCode::InvalidArgument);
}

TEST_CASE("a large negative fill value leaves the other values what they are") {
  VdiGenerator generator(device(), comm::Communicator::serial());
  const auto pictureOf = [&](ScalarType type, double fill, double top) {
    const synthetic::Lattice lattice{glm::ivec3(12), glm::dvec3(0.0), glm::dvec3(1.0 / 11.0), type,
                                     Joint::SharedPoints};
    generator.setBlocks(
        {synthetic::makeBlock(lattice, {{0, 0, 0}, glm::ivec3(12), 0}, [&](const glm::ivec3& i) {
          return i == glm::ivec3(3, 4, 5) ? fill : top * ((i.x * 7 + i.y * 3 + i.z * 5) % 11) / 11.0;
        })});
    return *generator.renderVolume(test::oblique(), test::threeHues(top), test::smallSettings());
  };
  struct Case {
    ScalarType type;
    double fill;
    double top;
  };
  for (const Case& c : {Case{ScalarType::F64, -1e30, 1.0}, Case{ScalarType::F64, -9999.0, 0.02},
                        Case{ScalarType::I32, -2147483648.0, 1100.0}}) {
    INFO(toString(c.type) << " " << c.fill);
    const Image expected = pictureOf(ScalarType::F32, c.fill, c.top);
    const Image seen = pictureOf(c.type, c.fill, c.top);
    CHECK(highestOpacity(expected) > 0.5F);
    float worst = 0.0F;
    for (std::size_t i = 0; i < seen.rgba.size(); ++i)
      worst = std::max(worst, glm::length(seen.rgba[i] - expected.rgba[i]));
    CHECK(worst < 1.0F / 255.0F);
  }
}

TEST_CASE("a camera too far away and a ray too long for the device are refused") {
  VdiGenerator generator(device(), comm::Communicator::serial());
  const GenerateSettings settings = test::smallSettings(16, 12);
  generator.setBlocks(
      {cube(8, 1.0 / 7.0, [](const glm::ivec3& i) { return 0.1F * static_cast<float>(i.x); })});
  Camera far = test::oblique(true);
  far.position = far.focalPoint + 1e6 * (far.position - far.focalPoint);
  CHECK(codeOf([&] { generator.generate(far, test::threeHues(1.0), settings); }) ==
        ErrorCode::InvalidArgument);
  if (!device()->isCpu()) return;
  const synthetic::Lattice lattice{
      {2, 2, 40000}, glm::dvec3(0.0), {20000.0, 20000.0, 1.0}, ScalarType::U8, Joint::SharedPoints};
  generator.setBlocks({synthetic::makeBlock(lattice, {{0, 0, 0}, {2, 2, 40000}, 0},
                                            [](const glm::ivec3& i) { return i.z > 39990 ? 100.0 : 0.0; })});
  const Camera along = Camera::framing(generator.scene().bounds, {0.0, 0.0, -1.0}, {0.0, 1.0, 0.0});
  GenerateSettings fine = settings;
  fine.samplesPerVoxel = 2.0;
  CHECK(codeOf([&] { generator.renderVolume(along, test::threeHues(100.0), fine); }) ==
        ErrorCode::InvalidArgument);
  // A ray that the device can take shows the material at its end.
  CHECK(highestOpacity(*generator.renderVolume(along, test::threeHues(100.0), settings)) > 0.5F);
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
  // The generator still works after all that.
  CHECK(
      generator.generate(test::oblique(), test::threeHues(1.0), test::smallSettings())->supersegmentCount() >
      0);
}

TEST_CASE("points in one plane are a sheet one spacing thick, on any axis and in several blocks") {
  VdiGenerator generator(device(), comm::Communicator::serial());
  const glm::dvec3 spacing(0.08, 0.1, 0.09);
  for (int axis = 0; axis < 3; ++axis) {
    INFO("axis " << axis);
    glm::ivec3 size(12, 10, 11);
    size[axis] = 1;
    const auto valueAt = [axis](glm::ivec3 i) {
      i[axis] = 0;
      return 0.5 + 0.5 * std::sin(0.7 * i.x + 0.4 * i.y + 0.9 * i.z);
    };
    const auto pictureOf = [&](const glm::ivec3& dims, const glm::dvec3& origin, const glm::ivec3& blocks) {
      const synthetic::Lattice lattice{dims, origin, spacing, ScalarType::F32, Joint::SharedPoints};
      std::vector<Block> all;
      for (const synthetic::Part& part :
           synthetic::decompose(dims, blocks, synthetic::Layout::OnOneRank, Joint::SharedPoints, 1, 1))
        all.push_back(synthetic::makeBlock(lattice, part, valueAt));
      generator.setBlocks(all);
      GenerateSettings settings = test::smallSettings();
      settings.samplesPerVoxel = 4.0;
      const Camera camera =
          Camera::framing({glm::dvec3(0.0), glm::dvec3(1.0)}, {-0.6, -0.7, -0.9}, {0.0, 1.0, 0.0});
      CHECK(flatten(*generator.generate(camera, test::threeHues(1.0), settings)).rgba.size() > 0);
      return *generator.renderVolume(camera, test::threeHues(1.0), settings);
    };
    glm::ivec3 thick = size;
    thick[axis] = 2;
    glm::dvec3 below(0.0);
    below[axis] = -0.5 * spacing[axis];
    const Image expected = pictureOf(thick, below, glm::ivec3(1));
    CHECK(highestOpacity(expected) > 0.2F);
    for (const glm::ivec3& blocks : {glm::ivec3(1), glm::ivec3(2)}) {
      const Image seen = pictureOf(size, glm::dvec3(0.0), blocks);
      float worst = 0.0F;
      for (std::size_t i = 0; i < seen.rgba.size(); ++i)
        worst = std::max(worst, glm::length(seen.rgba[i] - expected.rgba[i]));
      CHECK(worst < 2.0F / 255.0F);
    }
  }
}
