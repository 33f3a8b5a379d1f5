// Lists that begin and end on faces of the VDI's box, which V_O's rays graze: views of them have the box's
// faces, without steps from list to list.
#include <algorithm>
#include <cmath>

#include "tests/Catch.h"
#include "tests/Devices.h"
#include "tests/Scenes.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vdi/pipeline/VdiRenderer.h"
#include "vdi/reference/Reference.h"

using namespace vdi;

namespace {

/// A function so opaque that views show little but the box's faces.
TransferFunction dense() {
  TransferFunction function;
  function.colors = {{0.0, {0.0, 0.0, 1.0}}, {0.5, {0.0, 1.0, 0.0}}, {1.0, {1.0, 0.0, 0.0}}};
  function.opacities = {{0.0, 0.7}, {1.0, 0.7}};
  function.unitDistance = 0.05;
  return function;
}

/// Its rays run nearly along four faces of the unit cube.
Camera headOn(bool parallel) {
  Camera camera = Camera::framing({glm::dvec3(0.0), glm::dvec3(1.0)}, {-0.02, -0.03, -1.0}, {0.0, 1.0, 0.0});
  camera.parallelProjection = parallel;
  return camera;
}

float largestChannel(const glm::vec4& difference) {
  const glm::vec4 size = glm::abs(difference);
  return std::max({size.r, size.g, size.b, size.a});
}

std::size_t pixelsThatDiffer(const Image& a, const Image& b, float most) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i)
    count += largestChannel(a.rgba[i] - b.rgba[i]) > most ? 1 : 0;
  return count;
}

/// Root of the mean square, in 1/255.
double errorOf(const Image& seen, const Image& truth) {
  double sum = 0.0;
  for (std::size_t i = 0; i < truth.rgba.size(); ++i) {
    const glm::vec4 difference = 255.0F * (seen.rgba[i] - truth.rgba[i]);
    sum += static_cast<double>(glm::dot(difference, difference)) / 4.0;
  }
  return std::sqrt(sum / static_cast<double>(truth.rgba.size()));
}

}  // namespace

TEST_CASE("box faces: views along them are the reference's, and nearer to the volume than without",
          "[pictures]") {
  const auto decomposed = test::onOneRank("turbulence", {24, 24, 24});
  VdiGenerator generator(test::device(), comm::Communicator::serial());
  generator.setBlocks(decomposed.mine);
  const GenerateSettings settings = test::smallSettings(48, 40);
  GenerateSettings fine = test::smallSettings(80, 64);
  fine.samplesPerVoxel = 8.0;
  for (const bool parallel : {false, true}) {
    const Camera camera = headOn(parallel);
    const auto vdi = generator.generate(camera, dense(), settings);
    Vdi open = *vdi;
    open.bounds = Box{};
    for (const auto& device : {test::device(), test::device(true)}) {
      VdiRenderer renderer(device);
      VdiRenderer without(device);
      renderer.setVdi(*vdi);
      without.setVdi(open);
      for (const double degrees : {0.0, 50.0, 90.0, 108.0, 180.0, 270.0}) {
        INFO(degrees << " degrees, parallel " << parallel);
        const Camera turned = camera.azimuth(degrees);
        const View view(turned, fine.width, fine.height);
        const Image seen = renderer.render(view, {}, Reconstruction::Sheared);
        const Image expected = reference::render(*vdi, view, Reconstruction::Sheared);
        CHECK(pixelsThatDiffer(seen, expected, 1.0F / 255.0F) <= seen.rgba.size() / 100);
        const auto truth = generator.renderVolume(turned, dense(), fine);
        const Image stepped = without.render(view, {}, Reconstruction::Sheared);
        CHECK(errorOf(seen, *truth) < 0.9 * errorOf(stepped, *truth));
      }
    }
  }
}

TEST_CASE("box faces: the picture of V_O is the same") {
  const auto decomposed = test::onOneRank("ramp", {20, 24, 22});
  VdiGenerator generator(test::device(), comm::Communicator::serial());
  generator.setBlocks(decomposed.mine);
  const Camera camera = headOn(GENERATE(false, true));
  const auto vdi = generator.generate(camera, dense(), test::smallSettings(48, 40));
  const Image smooth = reference::render(*vdi, vdi->view(), Reconstruction::Smooth);
  const Image sheared = reference::render(*vdi, vdi->view(), Reconstruction::Sheared);
  CHECK(pixelsThatDiffer(smooth, sheared, 1.0F / 255.0F) == 0);
}
