// Views of a VDI clipped by planes: the device compared with the reference, and with views that need no
// planes.
#include <algorithm>
#include <cmath>
#include <vector>
#include "tests/Catch.h"

#include "tests/Devices.h"
#include "tests/Scenes.h"
#include "vdi/core/Error.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vdi/pipeline/VdiRenderer.h"
#include "vdi/reference/Reference.h"

using namespace vdi;

namespace {

Vdi makeVdi(const Camera& camera) {
  const auto decomposed = test::onOneRank("turbulence", {24, 24, 24});
  VdiGenerator generator(test::device(), comm::Communicator::serial());
  generator.setBlocks(decomposed.mine);
  return *generator.generate(camera, test::threeHues(0.8), test::smallSettings(56, 44));
}

std::size_t pixelsOffBy(const Image& a, const Image& b, float tolerance) {
  REQUIRE(a.rgba.size() == b.rgba.size());
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i) {
    float worst = 0.0F;
    for (int c = 0; c < 4; ++c) worst = std::max(worst, std::abs(a.rgba[i][c] - b.rgba[i][c]));
    count += 255.0F * worst > tolerance ? 1 : 0;
  }
  return count;
}

}  // namespace

TEST_CASE("clipped views: those of the reference, from anywhere", "[pictures]") {
  const std::vector<ClipPlane> planes{{{0.5, 0.5, 0.6}, {0.2, -0.3, -1.0}},
                                      {{0.3, 0.0, 0.0}, {2.0, 0.5, 0.0}}};
  for (const auto& device : {test::device(), test::device(true)}) {
    VdiRenderer renderer(device);
    for (const bool parallel : {false, true}) {
      const Camera camera = test::oblique(parallel);
      const Vdi vdi = makeVdi(camera);
      renderer.setVdi(vdi);
      for (const double degrees : {0.0, 25.0, 110.0}) {
        for (const Reconstruction reconstruction : test::reconstructions) {
          INFO(degrees << (parallel ? ", parallel" : ""));
          const Camera turned = camera.azimuth(degrees);
          renderer.setClipPlanes({});
          const Image whole = renderer.render(turned, 40, 32, reconstruction);
          renderer.setClipPlanes(planes);
          const Image seen = renderer.render(turned, 40, 32, reconstruction);
          const Image expected = reference::render(vdi, View(turned, 40, 32), reconstruction, {}, planes);
          CHECK(pixelsOffBy(seen, expected, 1.0F) <= seen.rgba.size() / 100);
          CHECK(pixelsOffBy(seen, whole, 8.0F) > seen.rgba.size() / 20);
        }
      }
    }
  }
}

TEST_CASE(
    "clipped views: a plane's two sides together are the whole, and one is what rays see that end there") {
  const Camera camera = test::oblique();
  const Vdi vdi = makeVdi(camera);
  VdiRenderer renderer(test::device());
  renderer.setVdi(vdi);
  const View view(camera.azimuth(20.0), 40, 32);
  const Image whole = renderer.render(view, {});
  const glm::dvec3 middle(0.5);
  renderer.setClipPlanes({{middle, -view.forward()}});
  const Image front = renderer.render(view, {});
  renderer.setClipPlanes({{middle, view.forward()}});
  const Image back = renderer.render(view, {});
  renderer.setClipPlanes({});
  const std::vector<float> ends(whole.rgba.size(), static_cast<float>(view.depthOf(middle)));
  const Image ending = renderer.render(view, ends);
  Image both = front;
  for (std::size_t i = 0; i < both.rgba.size(); ++i) both.rgba[i] += (1.0F - front.rgba[i].a) * back.rgba[i];
  CHECK(pixelsOffBy(front, ending, 0.5F) == 0);
  CHECK(pixelsOffBy(both, whole, 3.0F) <= whole.rgba.size() / 100);
  CHECK(pixelsOffBy(front, whole, 8.0F) > whole.rgba.size() / 20);
}

TEST_CASE("clipped views: everything or nothing, and refusals") {
  const Camera camera = test::oblique();
  VdiRenderer renderer(test::device());
  renderer.setVdi(makeVdi(camera));
  const Image whole = renderer.render(camera, 40, 32);
  renderer.setClipPlanes({{glm::dvec3(-1.0), glm::dvec3(1.0)}});
  CHECK(pixelsOffBy(renderer.render(camera, 40, 32), whole, 0.5F) == 0);
  renderer.setClipPlanes({{glm::dvec3(-1.0), glm::dvec3(-1.0)}});
  for (const glm::vec4& pixel : renderer.render(camera, 40, 32).rgba) CHECK(pixel == glm::vec4(0.0F));
  CHECK_THROWS_AS(renderer.setClipPlanes(std::vector<ClipPlane>(7)), Error);
  CHECK_THROWS_AS(renderer.setClipPlanes({{glm::dvec3(0.0), glm::dvec3(0.0)}}), Error);
}
