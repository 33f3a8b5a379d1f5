#include "vdi/reference/Slopes.h"

#include <cmath>

#include "shaders/shared/render.h"
#include "tests/Catch.h"
#include "tests/Scenes.h"
#include "vdi/reference/Reference.h"

namespace {

using namespace vdi;
using reference::Slopes;
using reference::SlopeUnit;

constexpr glm::ivec2 size{5, 4};
/// A slope of 1 is a depth of 8 / 127 per list.
constexpr SlopeUnit unit{1.0F, shared::renderMaxSlope / shared::renderSlopes};

/// The nearest slope to a change of depth from list to list.
int slopeOf(float change) {
  return static_cast<int>(std::lround(change / unit.unit));
}

bool isNear(int slope, float change) {
  return std::abs(slope - slopeOf(change)) <= 1;
}

/// `listAt(x, y)` makes each list.
template <typename ListAt>
SupersegmentLists listsOf(ListAt listAt) {
  SupersegmentLists lists;
  for (int y = 0; y < size.y; ++y) {
    for (int x = 0; x < size.x; ++x) {
      for (const Supersegment& segment : listAt(x, y)) lists.segments.push_back(segment);
      lists.offsets.push_back(static_cast<std::uint32_t>(lists.segments.size()));
    }
  }
  return lists;
}

/// The slopes of lists that lie in no box.
std::vector<Slopes> slopesOf(const SupersegmentLists& lists) {
  const View original(Camera{}, size.x, size.y);
  return reference::slopesOf(lists, original, unit, {facesOf({}, original), {}});
}

using List = std::vector<Supersegment>;

/// Two layers that touch each other, the front one thin; its front lies at `depth`.
List layersAt(float depth) {
  return {{depth, depth + 0.5F, 0.2F, 0.1F, 0.1F, 0.5F},
          {depth + 0.5F, depth + 3.0F, 0.1F, 0.6F, 0.2F, 0.9F}};
}

}  // namespace

TEST_CASE("reference: the faces of a tilted layer lean as it does") {
  const auto depthAt = [](int x, int y) {
    return 20.0F + 2.5F * static_cast<float>(x) - 0.75F * static_cast<float>(y);
  };
  const SupersegmentLists lists = listsOf([&](int x, int y) { return layersAt(depthAt(x, y)); });
  for (const Slopes& slopes : slopesOf(lists)) {
    CHECK(isNear(slopes.frontX, 2.5F));
    CHECK(isNear(slopes.backX, 2.5F));
    CHECK(isNear(slopes.frontY, -0.75F));
    CHECK(isNear(slopes.backY, -0.75F));
  }
}

TEST_CASE("reference: a face leans to where the neighbour has the same optical depth in front of it") {
  // Each list splits the same material elsewhere, so no faces but the outermost ones correspond.
  const auto listAt = [](int x, int) {
    const float front = 20.0F + static_cast<float>(x);
    const float split = 1.0F + 0.3F * static_cast<float>(x);
    const auto layer = [&](float from, float to) {
      const float opacity = opacityOf(to - from);
      return Supersegment{front + from, front + to, opacity, 0.0F, 0.0F, opacity};
    };
    return List{layer(0.0F, split), layer(split, 4.0F)};
  };
  for (const Slopes& slopes : slopesOf(listsOf(listAt))) {
    CHECK(isNear(slopes.frontX, 1.0F));
    CHECK(isNear(slopes.backX, 1.0F));
    CHECK(slopes.frontY == 0);
  }
}

TEST_CASE("reference: faces of the rear half are found from behind") {
  // The second list has more haze in front of the same opaque layer.
  const auto listAt = [](int x, int) {
    const float haze = x % 2 == 0 ? 0.1F : 0.2F;
    return List{{10.0F, 11.0F, 0.0F, haze, 0.0F, haze}, {11.0F, 12.0F, 0.99F, 0.0F, 0.0F, 0.99F}};
  };
  const SupersegmentLists lists = listsOf(listAt);
  const std::vector<Slopes> slopes = slopesOf(lists);
  for (std::size_t i = 0; i < slopes.size(); i += 2) {
    CHECK(slopes[i].frontX == 0);
    CHECK(slopes[i + 1].backX == 0);
  }
}

TEST_CASE("reference: faces without a counterpart don't lean") {
  const auto isFlat = [](const SupersegmentLists& lists) {
    bool flat = !lists.segments.empty();
    for (const Slopes& slopes : slopesOf(lists)) flat = flat && slopes == Slopes{};
    return flat;
  };
  CHECK(isFlat(listsOf([](int x, int y) { return x == 2 && y == 2 ? layersAt(20.0F) : List{}; })));
  // Farther apart than renderMaxSlope footprints.
  CHECK(isFlat(
      listsOf([](int x, int y) { return layersAt(20.0F + 15.0F * static_cast<float>((x + y) % 2)); })));
  // Haze has no faces.
  CHECK(isFlat(listsOf([](int x, int) {
    const float front = 20.0F + static_cast<float>(x);
    return List{{front, front + 4.0F, 0.05F, 0.05F, 0.05F, 0.1F}};
  })));
}

TEST_CASE("reference: sheared views of a surface a voxel wide are truer than smooth ones") {
  constexpr int side = 24;
  const synthetic::Lattice lattice{glm::ivec3(side), glm::dvec3(0.0), glm::dvec3(1.0 / (side - 1)),
                                   ScalarType::F32, synthetic::Joint::SharedPoints};
  const auto parts = synthetic::decompose(glm::ivec3(side), glm::ivec3(1), synthetic::Layout::Slabs,
                                          synthetic::Joint::SharedPoints, 1, 3);
  const std::vector<Block> blocks{synthetic::makeBlock(lattice, parts.front(), [](const glm::ivec3& index) {
    const double radius = glm::length(glm::dvec3(index) - 0.5 * (side - 1));
    return glm::clamp(0.42 * side - radius + 0.5, 0.0, 1.0);
  })};
  TransferFunction function = test::threeHues(1.0, 1.0 / side);
  function.opacities = {{0.0, 0.0}, {0.3, 0.0}, {0.35, 0.9}, {1.0, 0.9}};
  const Camera camera = test::oblique(GENERATE(false, true));
  const GenerateSettings settings = test::smallSettings(64, 48, 10);
  const Scene scene = localScene(blocks);
  Vdi vdi;
  vdi.camera = camera;
  vdi.width = settings.width;
  vdi.height = settings.height;
  vdi.lists = reference::generate(reference::RayInputs(scene, camera, function, settings), blocks, false);
  GenerateSettings fine = settings;
  fine.samplesPerVoxel = 8.0;
  for (const double angle : {10.0, 30.0, 50.0}) {
    const Camera turned = camera.azimuth(angle);
    const Image truth = reference::renderVolume(reference::RayInputs(scene, turned, function, fine), blocks);
    const auto errorOf = [&](Reconstruction reconstruction) {
      const Image seen =
          reference::render(vdi, View(turned, settings.width, settings.height), reconstruction);
      double error = 0.0;
      for (std::size_t i = 0; i < truth.rgba.size(); ++i) {
        const glm::vec4 difference = glm::abs(seen.rgba[i] - truth.rgba[i]);
        error += static_cast<double>(difference.r + difference.g + difference.b);
      }
      return error;
    };
    INFO("from " << angle << " degrees");
    CHECK(errorOf(Reconstruction::Sheared) < 0.8 * errorOf(Reconstruction::Smooth));
  }
  const Image own = reference::render(vdi, vdi.view(), Reconstruction::Smooth);
  const Image sheared = reference::render(vdi, vdi.view(), Reconstruction::Sheared);
  for (std::size_t i = 0; i < own.rgba.size(); ++i)
    CHECK(glm::all(glm::lessThan(glm::abs(own.rgba[i] - sheared.rgba[i]), glm::vec4(1e-5F))));
}
