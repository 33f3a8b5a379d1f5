// Views of a VDI on the device compared with the reference.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "tests/pipeline/AgainstReference.h"
#include "vdi/comm/Communicator.h"
#include "vdi/core/Flatten.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vdi/pipeline/VdiRenderer.h"
#include "vdi/reference/Reference.h"

using namespace vdi;
using test::depthsThatDiffer;
using test::device;
using test::deviceAsGpu;
using test::isView;
using test::rounding;

namespace {

/// A sparse VDI: most of its tiles are empty.
Vdi coilFrom(const Camera& camera) {
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks(test::onOneRank("coil", {40, 40, 40}, {1, 1, 1}, ScalarType::U8).mine);
  return *generator.generate(camera, test::threeHues(80.0), test::smallSettings(121, 83, 6));
}

/// Renderers of one VDI, on the device and on one that runs a GPU's programs.
struct BothRenderers {
  explicit BothRenderers(const Vdi& vdi) {
    plain.setVdi(vdi);
    asGpu.setVdi(vdi);
  }
  VdiRenderer plain{device()};
  VdiRenderer asGpu{deviceAsGpu()};
};

}  // namespace

TEST_CASE("rays leave a picture within a tile of lists, through material at its edge", "[pictures]") {
  const auto decomposed = test::onOneRank("interface", {24, 24, 24});
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
      // Rounding lets a few of the many rays pass the last list.
      const Image seen = renderer.render(camera.azimuth(angle), 160, 160);
      const auto isSound = [](const glm::vec4& p) { return p.a >= 0.0F && p.a <= 1.0F && p.r >= 0.0F; };
      CHECK(std::all_of(seen.rgba.begin(), seen.rgba.end(), isSound));
      CHECK(std::any_of(seen.rgba.begin(), seen.rgba.end(), [](const glm::vec4& p) { return p.a > 0.5F; }));
    }
  }
}

TEST_CASE("bytes of a view are those of its floats, whichever was asked for before") {
  const auto decomposed = test::onOneRank("shells", {24, 24, 24});
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

TEST_CASE("views of a sparse VDI, most of whose tiles are skipped: as in the reference", "[pictures]") {
  const bool parallel = GENERATE(false, true);
  const Camera camera = test::oblique(parallel);
  const Vdi vdi = coilFrom(camera);
  BothRenderers renderers(vdi);
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
      const Image expected = reference::render(vdi, View(cameras[i], 65, 47), reconstruction);
      seenFrom += std::any_of(expected.rgba.begin(), expected.rgba.end(),
                              [](const glm::vec4& c) { return c.a > 0.1F; })
                      ? 1
                      : 0;
      for (VdiRenderer* each : {&renderers.plain, &renderers.asGpu}) {
        const Image seen = each->render(cameras[i], 65, 47, reconstruction);
        CHECK(isView(seen, expected, reconstruction));
        CHECK(depthsThatDiffer(seen, expected, 1e-3F) <= seen.depth.size() / 100);
      }
    }
  }
  CHECK(seenFrom >= std::size(test::reconstructions) * (cameras.size() - 1));
  CHECK(deviceAsGpu()->validationMessages() == "");
}

TEST_CASE("rays that end at objects, of any part of an image plane: as in the reference", "[pictures]") {
  const bool parallel = GENERATE(false, true);
  const Camera camera = test::oblique(parallel);
  const Vdi vdi = coilFrom(camera);
  BothRenderers renderers(vdi);
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
      // A slanted wall through the middle of the scene; to its left rays continue, to its right they end at
      // once.
      const double middle = view.depthOf(vdi.bounds.center());
      const double depth = glm::length(vdi.bounds.size());
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
        const Image open = reference::render(vdi, view, reconstruction);
        const Image expected = reference::render(vdi, view, reconstruction, ends);
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
        for (VdiRenderer* each : {&renderers.plain, &renderers.asGpu}) {
          CHECK(isView(each->render(view, ends, reconstruction), expected, reconstruction));
          // The view with ends doesn't affect the next one without.
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
  const auto decomposed = test::onOneRank("ramp", {8, 8, 8});
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
