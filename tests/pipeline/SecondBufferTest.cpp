// VdiRenderer's double buffering, and VDIs with fewer lists.
#include <future>
#include <vector>

#include "tests/Catch.h"
#include "tests/Devices.h"
#include "tests/Scenes.h"
#include "vdi/core/Error.h"
#include "vdi/core/ImageMetrics.h"
#include "vdi/core/Thinning.h"
#include "vdi/io/Png.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vdi/pipeline/VdiRenderer.h"

using namespace vdi;
using test::device;

namespace {

Vdi makeVdi(const char* field, int width, int height, const Camera& camera, Precision precision) {
  const auto decomposed = test::onOneRank(field, {32, 32, 32});
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks(decomposed.mine);
  GenerateSettings settings = test::smallSettings(width, height, 10);
  settings.precision = precision;
  return *generator.generate(camera, test::threeHues(1.0), settings);
}

Image viewOf(const Vdi& vdi, const Camera& camera) {
  VdiRenderer renderer(device());
  renderer.setVdi(vdi);
  return renderer.render(camera, 96, 80);
}

ImageDifference differenceOf(const Image& a, const Image& b) {
  return compare(io::toPicture(a).rgb, io::toPicture(b).rgb, a.width, a.height, 3);
}

}  // namespace

TEST_CASE("a VDI that is shown from the device's lists is the one that goes by way of the host",
          "[pictures]") {
  const auto decomposed = test::onOneRank("turbulence", {40, 36, 32}, {2, 2, 2});
  const auto other = gpu::Device::create(gpu::requestFromEnvironment(0));
  VdiRenderer renderer(device());
  VdiRenderer elsewhere(other);
  using Way = std::pair<std::uint32_t, Precision>;
  for (const auto& [bands, precision] : {Way{1U, Precision::Full}, Way{5U, Precision::Compact}}) {
    VdiGenerator generator(device(), comm::Communicator::serial(), {.bands = bands});
    generator.setBlocks(decomposed.mine);
    INFO(bands << " bands, " << toString(precision));
    GenerateSettings settings = test::smallSettings(90, 70, 8);
    settings.precision = precision;
    // The second frame has more supersegments than the first one reserved.
    for (const double density : {0.2, 20.0}) {
      const TransferFunction function = test::threeHues(density);
      const Vdi vdi = *generator.generate(test::oblique(), function, settings);
      generator.show(&renderer, test::oblique(), function, settings);
      // The generator's memory is reused before the renderer's.
      generator.generate(test::oblique().azimuth(90.0), test::threeHues(3.0), settings);
      generator.show(&elsewhere, test::oblique(), function, settings);
      const Camera camera = test::oblique().azimuth(25.0);
      const Image expected = viewOf(vdi, camera);
      for (VdiRenderer* const shows : {&renderer, &elsewhere}) {
        const Image image = shows->render(camera, expected.width, expected.height);
        CHECK(image.rgba == expected.rgba);
        CHECK(image.depth == expected.depth);
      }
    }
    const Progress stop = [](double) { return false; };
    CHECK_THROWS_AS(generator.show(&renderer, test::oblique(), test::threeHues(1.0), settings, stop), Error);
    CHECK_THROWS_AS(renderer.render(test::oblique(), 90, 70), Error);  // no VDI is shown
    CHECK_THROWS_AS(generator.show(nullptr, test::oblique(), test::threeHues(1.0), settings), Error);
    generator.setBlocks({});
    generator.show(&renderer, test::oblique(), test::threeHues(1.0), settings);
    CHECK(renderer.render(test::oblique(), 9, 7).rgba[31] == glm::vec4(0.0F));
  }
}

TEST_CASE("a VDI that is prepared during renders changes none of them until it is shown") {
  const Camera camera = test::oblique();
  const Camera turned = camera.azimuth(15.0);
  std::vector<Vdi> vdis;
  std::vector<Image> expected;
  for (const char* field : {"mixing", "sphere", "turbulence"}) {
    const int width = 96 + 32 * static_cast<int>(vdis.size());
    vdis.push_back(
        makeVdi(field, width, 80, camera, vdis.size() == 1 ? Precision::Full : Precision::Compact));
    expected.push_back(viewOf(vdis.back(), turned));
  }
  VdiRenderer renderer(device());
  CHECK_FALSE(renderer.showPrepared());
  renderer.prepareVdi(vdis[0]);
  CHECK_THROWS_AS(renderer.render(turned, 96, 80), Error);  // no VDI is shown
  CHECK(renderer.showPrepared());
  std::size_t shown = 0;
  for (const std::size_t next : {1U, 2U, 0U, 2U, 1U}) {
    std::future<void> preparation =
        std::async(std::launch::async, [&renderer, &vdis, next] { renderer.prepareVdi(vdis[next]); });
    for (int frame = 0; frame < 3; ++frame) {
      CHECK(renderer.render(turned, 96, 80).rgba == expected[shown].rgba);
    }
    preparation.get();
    CHECK(renderer.render(turned, 96, 80).rgba == expected[shown].rgba);
    CHECK(renderer.showPrepared());
    CHECK_FALSE(renderer.showPrepared());
    CHECK(renderer.render(turned, 96, 80).rgba == expected[next].rgba);
    shown = next;
  }
  renderer.prepareVdi(vdis[0]);
  renderer.setVdi(vdis[2]);
  CHECK(renderer.render(turned, 96, 80).rgba == expected[2].rgba);
  CHECK(device()->validationMessages() == "");
}

TEST_CASE("few lists show about the same from everywhere", "[long]") {
  Camera camera = test::oblique();
  camera.parallelProjection = GENERATE(false, true);
  camera.parallelScale = 0.8;
  // Neither side is a multiple of the factor.
  const Vdi whole = makeVdi("mixing", 310, 253, camera, GENERATE(Precision::Compact, Precision::Full));
  CHECK(thinned(whole, 1).lists == whole.lists);
  const Vdi few = thinned(whole, 4);
  CHECK_NOTHROW(validate(few));
  CHECK(few.width == 78);
  CHECK(few.height == 64);
  CHECK(few.supersegmentCount() < whole.supersegmentCount() / 12);
  CHECK(few.supersegmentCount() > whole.supersegmentCount() / 20);
  for (const double angle : {0.0, 20.0, 60.0}) {
    const ImageDifference difference =
        differenceOf(viewOf(few, camera.azimuth(angle)), viewOf(whole, camera.azimuth(angle)));
    INFO(angle << " degrees, SSIM " << difference.ssim);
    CHECK(difference.ssim > 0.9);
    CHECK(difference.ssim < 1.0);
  }
}
