// Camera, sample lattice, transfer tables, blocks and the checks of a VDI.
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <numeric>
#include <optional>
#include <random>
#include <regex>
#include <string>
#include <vector>

#include "tests/Catch.h"
#include "vdi/core/Block.h"
#include "vdi/core/BoxFaces.h"
#include "vdi/core/Camera.h"
#include "vdi/core/Error.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/core/Image.h"
#include "vdi/core/Margin.h"
#include "vdi/core/Parallel.h"
#include "vdi/core/Scene.h"
#include "vdi/core/SettingsTable.h"
#include "vdi/core/SlabTable.h"
#include "vdi/core/TransferFunction.h"
#include "vdi/core/Vdi.h"
#include "vdi/core/Viewpoint.h"

using namespace vdi;

TEST_CASE("bytes of colours are rounded to the nearest") {
  for (int i = 0; i <= 1 << 20; ++i) {
    const float share = std::ldexp(static_cast<float>(i), -20);
    if (toByte(share) != std::lround(share * 255.0F)) FAIL(share);
  }
  CHECK(toByte(std::nextafter(1.0F, 0.0F)) == 255);
  CHECK(toByte(-1.0F) == 0);
  CHECK(toByte(2.0F) == 255);
  CHECK(toByte(std::numeric_limits<float>::infinity()) == 255);
  CHECK(toByte(std::numeric_limits<float>::quiet_NaN()) == 0);
}

TEST_CASE("work in parallel: each element once, exceptions come out") {
  for (const std::size_t count : {0U, 1U, 7U, 1000U, 12345U}) {
    std::vector<int> visits(count, 0);
    inParallel(count, 10, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) ++visits[i];
    });
    CHECK(std::ranges::all_of(visits, [](int n) { return n == 1; }));
  }
  const auto failAtTheEnd = [](std::size_t, std::size_t last) {
    if (last == 1000) throw Error(ErrorCode::InvalidArgument, "as asked");
  };
  CHECK_THROWS_AS(inParallel(1000, 10, failAtTheEnd), Error);
}

TEST_CASE("a vector's tail is replaced, in place and beyond") {
  const std::size_t many = (std::size_t{1} << 22) + 3;  // enough bytes for several threads
  for (const std::size_t before : {std::size_t{0}, std::size_t{5}, many, 2 * many}) {
    for (const std::size_t first : {std::size_t{0}, std::size_t{5}}) {
      if (first > before) continue;
      INFO(before << " elements, from " << first);
      std::vector<std::uint32_t> to(before, 1U);
      std::vector<std::uint32_t> from(many);
      std::iota(from.begin(), from.end(), 7U);
      replaceTail<std::uint32_t>(to, first, from);
      std::vector<std::uint32_t> expected(first, 1U);
      expected.insert(expected.end(), from.begin(), from.end());
      CHECK((to == expected));
    }
  }
}

TEST_CASE("the range of a block's finite values, wherever they stand") {
  std::mt19937 generator(5);
  for (const int count : {1, 3, 16, 17, 63, 64, 65, 200}) {
    std::vector<float> floats(static_cast<std::size_t>(count));
    for (float& value : floats) value = static_cast<float>(generator() % 1000) - 500.0F;
    for (int i = 0; i < count; i += 5)
      floats[static_cast<std::size_t>(i)] = std::numeric_limits<float>::quiet_NaN();
    for (int i = 1; i < count; i += 7)
      floats[static_cast<std::size_t>(i)] = -std::numeric_limits<float>::infinity();
    ScalarRange expected;
    for (const float value : floats) {
      if (!std::isfinite(value)) continue;
      expected.min = std::min(expected.min, static_cast<double>(value));
      expected.max = std::max(expected.max, static_cast<double>(value));
    }
    const glm::dvec3 one(1.0);
    CHECK(ownRange(Block::fromPoints({count, 1, 1}, {}, one, ScalarType::F32, floats.data())) == expected);

    std::vector<std::int8_t> bytes(static_cast<std::size_t>(count));
    for (std::int8_t& value : bytes) value = static_cast<std::int8_t>(generator() % 100 - 50);
    const auto [minimum, maximum] = std::minmax_element(bytes.begin(), bytes.end());
    CHECK(ownRange(Block::fromPoints({count, 1, 1}, {}, one, ScalarType::I8, bytes.data())) ==
          ScalarRange{static_cast<double>(*minimum), static_cast<double>(*maximum)});
  }
  const double nothing[] = {std::numeric_limits<double>::infinity(),
                            std::numeric_limits<double>::quiet_NaN()};
  CHECK(ownRange(Block::fromPoints({2, 1, 1}, {}, glm::dvec3(1.0), ScalarType::F64, nothing)) ==
        ScalarRange());
}

namespace {

Camera cameraAside(bool parallel) {
  Camera camera;
  camera.position = {3.0, -2.0, 5.0};
  camera.focalPoint = {0.5, 0.2, -1.0};
  camera.parallelProjection = parallel;
  camera.parallelScale = 2.0;
  return camera;
}

}  // namespace

TEST_CASE("rays go through the points that they're named after") {
  for (const bool parallel : {false, true}) {
    const Camera camera = cameraAside(parallel);
    const View view(camera, 200, 100);
    const Ray middle = view.rayThrough(100.0, 50.0);
    CHECK(glm::length(middle.direction - view.forward()) < 1e-12);
    const Ray corner = view.rayThrough(0.0, 0.0);
    CHECK(glm::dot(corner.direction, view.forward()) == Approx(1.0));  // unit depth
    const glm::dvec3 seen = view.toView(corner.origin + 4.0 * corner.direction);
    CHECK(seen.z == Approx(4.0));
    CHECK(seen.x == Approx(-view.halfWidth() * (parallel ? 1.0 : 4.0)));
    CHECK(seen.y == Approx(-view.halfHeight() * (parallel ? 1.0 : 4.0)));  // row 0 is the bottom
  }
}

TEST_CASE("a margin has pixels of the picture's size around it") {
  for (const bool parallel : {false, true}) {
    const Camera camera = cameraAside(parallel);
    const View picture(camera, 200, 100);
    const View all = View::withMargin(camera, 200, 100, {30, 7});
    CHECK(all.width() == 260);
    CHECK(all.height() == 114);
    CHECK(all.halfHeight() / picture.halfHeight() == Approx(1.14));
    CHECK(all.halfWidth() / picture.halfWidth() == Approx(1.3));
    for (const glm::dvec2 at : {glm::dvec2(0.0), glm::dvec2(200.0, 0.0), glm::dvec2(12.5, 99.5)}) {
      const Ray ray = picture.rayThrough(at.x, at.y);
      const Ray same = all.rayThrough(at.x + 30.0, at.y + 7.0);
      CHECK(glm::length(ray.origin - same.origin) < 1e-12);
      CHECK(glm::length(ray.direction - same.direction) < 1e-12);
    }
  }
}

TEST_CASE("a margin is as large as asked for, but no larger than the scene") {
  const Box bounds{glm::dvec3(0.0), glm::dvec3(1.0)};
  const Scene scene{bounds, 0.02};
  GenerateSettings settings;
  settings.width = 160;
  settings.height = 90;
  for (const bool parallel : {false, true}) {
    Camera camera = Camera::framing(bounds, {-0.5, -0.35, -1.0}, {0.0, 1.0, 0.0});
    camera.parallelProjection = parallel;
    settings.margin = 0.5;
    CHECK(marginOf(scene, camera, settings) == glm::ivec2(0));  // the whole scene is in the picture
    // Zoomed in: first the whole margin, then the whole scene.
    camera.viewAngle /= 4.0;
    camera.parallelScale /= 4.0;
    settings.margin = 0.25;
    CHECK(marginOf(scene, camera, settings) == glm::ivec2(40, 23));
    settings.margin = maxMargin;
    const glm::ivec2 whole = marginOf(scene, camera, settings);
    CHECK(whole.x < 640);
    CHECK(whole.y < 360);
    const View all = viewWithMargin(scene, camera, settings);
    glm::dvec2 farthest{0.0};
    for (int corner = 0; corner < 8; ++corner) {
      const glm::dvec3 p = all.toView({corner & 1, corner >> 1 & 1, corner >> 2});
      farthest = glm::max(farthest, glm::abs(glm::dvec2(p)) / (parallel ? 1.0 : p.z));
    }
    const double pixel = 2.0 * all.halfHeight() / all.height();
    CHECK(farthest.x <= all.halfWidth());
    CHECK(farthest.y <= all.halfHeight());
    CHECK(farthest.x > all.halfWidth() - 3.0 * pixel);
    CHECK(farthest.y > all.halfHeight() - 3.0 * pixel);
  }
  // The scene reaches behind the eye: every direction shows something.
  Camera inside;
  inside.position = glm::dvec3(0.5, 0.5, 0.2);
  inside.focalPoint = glm::dvec3(0.5);
  settings.margin = 0.5;
  settings.samplesPerVoxel = 4.0;
  CHECK(marginOf(scene, inside, settings) == glm::ivec2(80, 45));
  // Excludes rays so oblique that a sample per voxel would not be a slab.
  settings.samplesPerVoxel = 1.0;
  settings.margin = maxMargin;
  const glm::ivec2 margin = marginOf(scene, inside, settings);
  CHECK(margin.x > 80);
  CHECK(margin.x < 640);
  const View all = viewWithMargin(scene, inside, settings);
  CHECK(samplesAreSlabs(scene, all, depthLattice(scene, all, 1.0)));
  CHECK(marginOf(Scene(), inside, settings) == glm::ivec2(0));
}

TEST_CASE("viewpoints from which a VDI shows nothing true are told from others") {
  const Box bounds{glm::dvec3(-1.0), glm::dvec3(1.0)};
  Camera original;
  original.position = {0.0, 0.0, 10.0};
  const auto issueFrom = [&](const Camera& camera) {
    return viewpointIssue(bounds, View(original, 64, 48), View(camera, 64, 48));
  };
  CHECK_FALSE(issueFrom(original));
  for (const double degrees : {-58.0, 30.0, 58.0}) CHECK_FALSE(issueFrom(original.azimuth(degrees)));
  for (const double degrees : {-62.0, 90.0, 180.0})
    CHECK(issueFrom(original.azimuth(degrees)) == ViewpointIssue::FarBeside);
  for (const bool parallel : {false, true}) {
    Camera camera = original;
    camera.parallelProjection = parallel;
    camera.parallelScale = 2.0;
    original.parallelProjection = parallel;
    CHECK_FALSE(issueFrom(camera));
    camera.focalPoint = {0.0, 0.0, 20.0};
    CHECK(issueFrom(camera) == ViewpointIssue::SeesNothing);  // looks away from the scene
    camera.position = {9.0, 0.0, 10.0};
    camera.focalPoint = {9.0, 0.0, 0.0};
    CHECK(issueFrom(camera) == ViewpointIssue::SeesNothing);  // looks past the scene
    camera.position = {0.9, 0.0, 0.0};
    CHECK(issueFrom(camera) == ViewpointIssue::Inside);
    original.position = camera.position;
    camera.position.x += 1e-8;
    CHECK(issueFrom(camera) != ViewpointIssue::Inside);  // V_O itself
    original.position = {0.0, 0.0, 10.0};
  }
  const View whole(original, 64, 48);
  CHECK_FALSE(viewpointIssue({}, whole, whole));
  original.parallelProjection = false;
  const auto issueInPart = [&](double left, double right) {
    return viewpointIssue(bounds, whole, View(original, 64, 48, ImagePlane{{left, -0.1}, {right, 0.1}}));
  };
  CHECK_FALSE(issueInPart(-0.3, -0.1));
  CHECK(issueInPart(-0.3, -0.2) == ViewpointIssue::SeesNothing);
}

TEST_CASE("what a VDI that is zoomed in lacks is nothing to be seen") {
  const Box bounds{glm::dvec3(-1.0), glm::dvec3(1.0)};
  for (const bool parallel : {false, true}) {
    Camera left;
    left.position = {-0.8, 0.0, 10.0};
    left.focalPoint = {-0.8, 0.0, 0.0};
    left.viewAngle = 2.0;
    left.parallelProjection = parallel;
    left.parallelScale = 0.17;
    Camera right = left;
    right.position.x = right.focalPoint.x = 0.8;
    const View seen(right, 64, 48);
    CHECK(viewpointIssue(bounds, View(left, 64, 48), seen) == ViewpointIssue::SeesNothing);
    CHECK_FALSE(viewpointIssue(bounds, View::withMargin(left, 64, 48, {300, 0}), seen));
    right.viewAngle = 20.0;
    right.parallelScale = 2.0;
    CHECK_FALSE(viewpointIssue(bounds, View(left, 64, 48), View(right, 64, 48)));
    right.position = {0.5, 0.0, 0.0};
    right.focalPoint = {1.0, 0.0, 0.0};
    CHECK(viewpointIssue(bounds, View(left, 64, 48), View(right, 64, 48)) == ViewpointIssue::SeesNothing);
  }
}

TEST_CASE("a view shows fewer lists from nearer") {
  const Box bounds{glm::dvec3(-1.0), glm::dvec3(1.0)};
  Camera original;
  original.position = {0.0, 0.0, 12.0};
  for (const bool parallel : {false, true}) {
    original.parallelProjection = parallel;
    original.parallelScale = 3.0;
    const View all(original, 640, 360);
    const auto across = [&](const Camera& camera) { return listsAcross(bounds, all, View(camera, 64, 36)); };
    CHECK(across(original) == Approx(640.0));
    CHECK(across(original.azimuth(90.0)) == Approx(640.0));
    Camera near = original;
    near.position.z = 3.0;
    near.parallelScale = 0.75;
    CHECK(across(near) == Approx(160.0));
    near.position.z = -3.0;  // behind the scene, and looks away from it
    near.focalPoint.z = -9.0;
    if (!parallel) CHECK(across(near) == 0.0);
  }
}

TEST_CASE("what is said of viewpoints") {
  for (const auto issue : {ViewpointIssue::Inside, ViewpointIssue::SeesNothing, ViewpointIssue::FarBeside})
    CHECK_FALSE(describe(issue).empty());
}

TEST_CASE("azimuth turns as vtkCamera does, and back") {
  Camera camera;
  camera.position = {0.0, 0.0, 2.0};
  const Camera right = camera.azimuth(90.0);
  CHECK(glm::length(right.position - glm::dvec3(2.0, 0.0, 0.0)) < 1e-12);
  CHECK(glm::length(right.azimuth(-90.0).position - camera.position) < 1e-12);
}

TEST_CASE("azimuth turns about view-up as it is set, whatever its direction and length") {
  // The expected positions are those of vtkCamera::Azimuth(50), VTK 9.1.
  Camera above;  // 20 degrees above its focal point
  const double elevation = glm::radians(20.0);
  above.focalPoint = {1.0, 2.0, 3.0};
  above.position = above.focalPoint + 10.0 * glm::dvec3(0.0, std::sin(elevation), std::cos(elevation));
  const glm::dvec3 aboveTurned(8.198463103929544, 5.420201433256687, 9.040227735550538);
  CHECK(glm::length(above.azimuth(50.0).position - aboveTurned) < 1e-12);

  Camera oblique = above;
  oblique.position = {4.0, -1.0, 8.0};
  const glm::dvec3 up(0.3, 0.8, -0.4);
  const glm::dvec3 turned(4.78054784088795, -3.24459190210122, 4.096227076463522);
  for (const double length : {1.0, 1e-3, 7.0, 1e-200, 1e200}) {
    INFO("view-up times " << length);
    oblique.viewUp = length * up;
    const Camera there = oblique.azimuth(50.0);
    CHECK(glm::length(there.position - turned) < 1e-12);
    CHECK(there.viewUp == oblique.viewUp);
    CHECK(there.focalPoint == oblique.focalPoint);
    CHECK(glm::length(there.azimuth(-50.0).position - oblique.position) < 1e-12);
    CHECK(glm::dot(View(there, 4, 4).up(), up) > 0.0);
  }
  oblique.viewUp = glm::dvec3(0.0);  // becomes y
  const glm::dvec3 aboutY(6.758585044654509, -1.0, 3.915804719075762);
  CHECK(glm::length(oblique.azimuth(50.0).position - aboutY) < 1e-12);
  CHECK(View(oblique, 4, 4).up().y > 0.0);
  // Parallel to the view direction: the camera stays in place.
  oblique.viewUp = 2.0 * (oblique.focalPoint - oblique.position);
  CHECK(glm::length(oblique.azimuth(50.0).position - oblique.position) < 1e-12);
  CHECK(oblique.azimuth(0.0) == oblique);
}

TEST_CASE("a camera that can't see is refused, a careless view-up is mended") {
  Camera camera;
  camera.viewUp = camera.focalPoint - camera.position;
  CHECK(std::abs(glm::dot(View(camera, 4, 4).up(), View(camera, 4, 4).forward())) < 1e-12);
  CHECK_THROWS_AS(View(camera, 0, 4), Error);
  camera.viewAngle = 180.0;
  CHECK_THROWS_AS(View(camera, 4, 4), Error);
  camera = {};
  camera.position = camera.focalPoint;
  CHECK_THROWS_AS(View(camera, 4, 4), Error);
  camera = {};
  camera.position.x = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(View(camera, 4, 4), Error);
}

TEST_CASE("the sample lattice covers the scene in front of the camera and nothing behind it") {
  const Scene scene{{glm::dvec3(0.0), glm::dvec3(1.0)}, 0.1};
  Camera camera;
  camera.position = {0.5, 0.5, 3.0};
  camera.focalPoint = glm::dvec3(0.5);
  const DepthLattice lattice = depthLattice(scene, View(camera, 8, 8), 1.0);
  CHECK(lattice.first == Approx(2.0));
  CHECK(lattice.step == Approx(0.1));
  CHECK(lattice.frontOf(lattice.count) >= 3.0 - 1e-9);
  CHECK(lattice.count <= 11);
  camera.position = {0.5, 0.5, 0.5};
  camera.focalPoint = {0.5, 0.5, 0.0};
  CHECK(depthLattice(scene, View(camera, 8, 8), 1.0).first == 0.0);
  camera.position = {0.5, 0.5, -1.0};
  camera.focalPoint = {0.5, 0.5, -2.0};
  CHECK(depthLattice(scene, View(camera, 8, 8), 1.0).count == 0);
  CHECK_THROWS_AS(depthLattice(scene, View(camera, 8, 8), 0.0), Error);
}

TEST_CASE("a face computed in two ways snaps to one float") {
  const Scene scene{{glm::dvec3(-0.3, 1.0, 7.0), glm::dvec3(11.7, 9.0, 8.0)}, 0.1};
  for (int i = 0; i <= 120; ++i) {
    const double upper = -0.3 + i * 0.1;          // origin + count * spacing
    const double lower = 11.7 - (120 - i) * 0.1;  // computed from the other end
    CHECK(snapToScene(scene, upper, 0) == snapToScene(scene, lower, 0));
  }
}

TEST_CASE("transfer functions are piecewise linear, with steps, constant outside") {
  TransferFunction function;
  function.colors = {{0.0, {1.0, 0.0, 0.0}}, {2.0, {0.0, 0.0, 1.0}}};
  function.opacities = {{0.0, 0.0}, {1.0, 0.2}, {1.0, 0.8}, {2.0, 1.0}};
  CHECK(function.opacityAt(-5.0) == 0.0);
  CHECK(function.opacityAt(0.5) == Approx(0.1));
  CHECK(function.opacityAt(1.0) == Approx(0.8));
  CHECK(function.opacityAt(9.0) == 1.0);
  CHECK(function.colorAt(0.5).r == Approx(0.75));
  const TransferTable table = bake(function);
  for (const double x : {-1.0, 0.25, 0.75, 1.5, 3.0}) {
    INFO(x);
    const TransferTableEntry entry = table.lookup(x);
    CHECK(entry.red == Approx(function.colorAt(x).r * entry.extinction).margin(2e-3 * entry.extinction));
    CHECK(1.0 - std::exp2(-entry.extinction) == Approx(function.opacityAt(x)).margin(2e-3));
  }
  CHECK(table.lookup(std::numeric_limits<double>::quiet_NaN()).extinction == 0.0F);
  CHECK(table.lookup(std::numeric_limits<double>::infinity()) == table.entries.back());
  CHECK(table.lookup(-std::numeric_limits<double>::infinity()) == table.entries.front());
  function.opacities = {{0.0, 0.0}, {1.0, 0.0}, {1.0001, 1.0}, {1.0002, 0.0}, {2.0, 0.0}};
  const TransferTable narrow = bake(function);
  CHECK(narrow.lookup(1.0001).extinction > 5.0F);
  CHECK(narrow.lookup(0.9999).extinction == 0.0F);
  function.opacities = {{1.0, 0.0}, {0.0, 1.0}};
  CHECK_THROWS_AS(bake(function), Error);
  function.opacities = {{0.0, 1.5}};
  CHECK_THROWS_AS(bake(function), Error);
}

TEST_CASE("transfer functions: a step has the value behind it at its scalar, and the one in front before") {
  const auto opacityAt = [](const TransferTable& table, double x) {
    return 1.0 - std::exp2(-table.lookup(x).extinction);
  };
  TransferFunction function;
  function.colors = {{0.5, {1.0, 0.5, 0.0}}};
  // At the lowest scalar of all, where colours have one node, two, or a step of their own.
  function.opacities = {{0.5, 0.0}, {0.5, 0.3}, {1.0, 0.3}};
  for (const std::vector<ColorNode>& colors :
       {function.colors, std::vector<ColorNode>{{0.5, {1.0, 0.5, 0.0}}, {1.0, {0.0, 0.5, 0.0}}},
        std::vector<ColorNode>{{0.5, {1.0, 0.0, 0.0}}, {0.5, {0.0, 1.0, 0.0}}, {1.0, {0.0, 1.0, 0.0}}}}) {
    function.colors = colors;
    const TransferTable table = bake(function);
    for (const double x : {-9.0, 0.0, 0.49}) CHECK(table.lookup(x).extinction == 0.0F);
    for (const double x : {0.5, 0.51, 0.9, 7.0}) CHECK(opacityAt(table, x) == Approx(0.3));
  }
  // Labels: values exactly at steps, wherever these lie among the entries.
  function.colors = {{0.0, {1.0, 1.0, 1.0}}};
  function.opacities = {{0.0, 0.1},  {20.0, 0.1},  {20.0, 0.4}, {61.0, 0.4},
                        {61.0, 0.2}, {100.0, 0.2}, {100.0, 0.6}};
  const TransferTable labels = bake(function);
  for (const auto& [x, opacity] : std::vector<std::pair<double, double>>{
           {0.0, 0.1}, {19.9, 0.1}, {20.0, 0.4}, {60.9, 0.4}, {61.0, 0.2}, {99.9, 0.2}, {100.0, 0.6}}) {
    INFO(x);
    CHECK(opacityAt(labels, x) == Approx(opacity).epsilon(1e-4));
  }
  // One scalar, as floats have it.
  for (const double at : {100.0, -7.3, 0.0}) {
    function.opacities = {{at, 0.0}, {at, 0.5}};
    const TransferTable one = bake(function);
    CHECK(opacityAt(one, at) == Approx(0.5));
    CHECK(one.max - one.min > 1e-4 * std::abs(at));
  }
}

namespace {

/// The function's mean over [lo, hi] in premultiplied colour and opacity of a unit distance, by many samples.
glm::dvec4 meanMaterial(const TransferFunction& function, double lo, double hi) {
  constexpr int samples = 200000;
  glm::dvec4 sum(0.0);
  for (int i = 0; i < samples; ++i) {
    const double x = lo + (hi - lo) * (i + 0.5) / samples;
    const double extinction = -std::log2(1.0 - function.opacityAt(x));
    sum += glm::dvec4(function.colorAt(x) * extinction, extinction);
  }
  const double depth = sum.a / samples;
  return depth > 0.0 ? sum / sum.a * (1.0 - std::exp2(-depth)) : glm::dvec4(0.0);
}

void checkMean(const TransferFunction& function, double lo, double hi) {
  INFO(lo << " to " << hi);
  const TransferTable table = bake(function);
  const SlabIntegral integral(table);
  const glm::dvec4 expected = meanMaterial(function, lo, hi);
  const glm::dvec4 off = glm::abs(integral.mean(table.positionOf(lo), table.positionOf(hi), 1.0) - expected);
  CHECK(std::max({off.r, off.g, off.b, off.a}) < 1.0 / 255.0);
}

}  // namespace

TEST_CASE("transfer functions: nothing is too narrow for the table") {
  // A peak beside a far outlier; then air in front of a jump, within the range and above it.
  TransferFunction function;
  function.colors = {{0.0, {1.0, 0.0, 0.0}}, {1e6, {0.0, 0.0, 1.0}}};
  for (const double behind : {0.0, 0.01}) {
    function.opacities = {{0.0, 0.0}, {20.0, 0.0}, {22.0, 0.5}, {24.0, 0.0}, {1e6, behind}};
    checkMean(function, 0.0, 19.9);
    checkMean(function, 21.9, 22.1);
    checkMean(function, 20.0, 24.0);
    checkMean(function, 23.0, 500.0);
    checkMean(function, 2e5, 1e6);
    checkMean(function, 9e5, 3e6);
  }
  for (const double scale : {65535.0, 1.0, 1e-20, 1e20}) {
    function.colors.back().x = scale;
    function.opacities = {{0.0, 0.0}, {0.01526 * scale, 0.0}, {0.0152754 * scale, 0.3}, {scale, 0.8}};
    for (const auto& [lo, hi] :
         {std::pair(0.0, 0.0152), std::pair(0.015, 0.01526), std::pair(0.015261, 0.015275),
          std::pair(0.01, 0.5), std::pair(0.3, 1.0), std::pair(0.9, 1.5), std::pair(1.0, 2.0)})
      checkMean(function, lo * scale, hi * scale);
    function.opacities = {{0.0, 0.9}, {0.7 * scale, 0.9}, {0.70001 * scale, 0.0}, {scale, 0.0}};
    checkMean(function, -scale, 0.6 * scale);
    checkMean(function, 0.6999 * scale, 0.70002 * scale);
    checkMean(function, 0.7001 * scale, 2.0 * scale);
  }
}

TEST_CASE("transfer functions: a peak of nearly opacity 1 has the mean of its slopes") {
  TransferFunction function;
  function.colors = {{0.0, {1.0, 0.0, 0.0}}, {1.0, {0.0, 1.0, 0.0}}};
  for (const double peak : {0.99, 1.0 - 1e-6, 1.0 - 1e-9}) {
    for (const double at : {0.25, 0.0501}) {
      function.opacities = {{0.0, 0.0}, {at, peak}, {2.0 * at, 0.0}, {1.0, 0.0}};
      checkMean(function, 0.0, 1.0);
      checkMean(function, 0.9 * at, 1.1 * at);
      checkMean(function, 0.0, at);
    }
  }
}

TEST_CASE("transfer functions: labels keep their colours, however large their ids are") {
  for (const std::vector<double>& ids : {std::vector<double>{0, 1, 2, 3},
                                         {0, 1, 1500},
                                         {0, 1, 2, 1800, 1950, 3071},
                                         {0, 4095, 6000, 7000},
                                         {0, 1, 997, 1009, 1097, 614454277},
                                         {0, 1, 182305689, 312782546, 312782550, 614454276, 614454277},
                                         {-614454277, -3, 0, 70000, 70001, 1e9}}) {
    TransferFunction function;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      const double share = static_cast<double>(i) / static_cast<double>(ids.size() - 1);
      for (const double side : {-0.5, 0.5}) {
        function.colors.push_back({ids[i] + side, {share, 1.0 - share, 0.3}});
        function.opacities.push_back({ids[i] + side, i == 0 ? 0.0 : 0.2 + 0.6 * share});
      }
      // What lies between labels is clear.
      if (i + 1 < ids.size() && ids[i + 1] - ids[i] > 1.5) {
        for (const double x : {ids[i] + 0.5, ids[i + 1] - 0.5}) {
          function.colors.push_back({x, {0.0, 0.0, 0.0}});
          function.opacities.push_back({x, 0.0});
        }
      }
    }
    const TransferTable table = bake(function);
    for (std::size_t i = 0; i < ids.size(); ++i) {
      INFO(ids[i] << " of " << ids.size());
      const bool isLost = std::ranges::find(table.lost, ids[i]) != table.lost.end();
      CHECK(isLost == (i > 0 && static_cast<float>(ids[i]) == static_cast<float>(ids[i - 1])));
      if (isLost) continue;
      const double share = static_cast<double>(i) / static_cast<double>(ids.size() - 1);
      const double opacity = i == 0 ? 0.0 : 0.2 + 0.6 * share;
      const glm::vec4 seen = table.materialAt(table.positionOf(ids[i]));
      CHECK(seen.a == Approx(opacity).margin(1e-3));
      CHECK(seen.r == Approx(share * opacity).margin(1e-3));
    }
  }
}

TEST_CASE("who owns what: points to the last point, cells whole, ghosts never") {
  const int value = 0;
  const Block points = Block::fromPoints({5, 5, 5}, glm::dvec3(1.0), glm::dvec3(0.5), ScalarType::I32, &value,
                                         {{1, 0, 0}, {1, 0, 0}});
  CHECK(points.owned.lo == glm::dvec3(1.5, 1.0, 1.0));
  CHECK(points.owned.hi == glm::dvec3(2.5, 3.0, 3.0));
  const Block cells = Block::fromCells({4, 4, 4}, glm::dvec3(0.0), glm::dvec3(0.5), ScalarType::I32, &value,
                                       {{0, 1, 0}, {0, 0, 2}});
  CHECK(cells.origin == glm::dvec3(0.25));
  CHECK(cells.owned.lo == glm::dvec3(0.0, 0.5, 0.0));
  CHECK(cells.owned.hi == glm::dvec3(2.0, 2.0, 1.0));
}

TEST_CASE("settings and names out of range are refused by name") {
  GenerateSettings settings;
  settings.supersegments = 1025;
  CHECK_THROWS_WITH(validate(settings),
                    vdi::test::ContainsSubstring("supersegments") && vdi::test::ContainsSubstring("1025"));
  settings.supersegments = 25;
  for (const double margin : {-0.1, 4.5, std::numeric_limits<double>::quiet_NaN()}) {
    settings.margin = margin;
    CHECK_THROWS_WITH(validate(settings), vdi::test::ContainsSubstring("margin"));
  }
  CHECK_THROWS_WITH(algorithmFromString("magic"), vdi::test::ContainsSubstring("bisection"));
  CHECK_THROWS_WITH(scalarTypeFromString("f16"), vdi::test::ContainsSubstring("f32"));
}

TEST_CASE("an invalid VDI is refused") {
  Vdi vdi;
  vdi.width = 2;
  vdi.height = 1;
  vdi.budget = 2;
  vdi.lists = SupersegmentLists{{0, 2, 2},
                                {{1.0F, 2.0F, 0.1F, 0.1F, 0.1F, 0.5F}, {2.0F, 3.0F, 0.1F, 0.1F, 0.1F, 1.0F}}};
  CHECK_NOTHROW(validate(vdi));
  const auto broken = [&](auto change) {
    Vdi copy = vdi;
    change(copy);
    CHECK_THROWS_AS(validate(copy), Error);
  };
  broken([](Vdi& v) { v.budget = 1; });
  broken([](Vdi& v) { v.width = 3; });
  broken([](Vdi& v) { v.margin.x = 1; });
  broken([](Vdi& v) { v.margin.y = -1; });
  broken([](Vdi& v) { v.margin.y = std::numeric_limits<int>::max(); });
  broken([](Vdi& v) { std::get<SupersegmentLists>(v.lists).offsets.back() = 3; });
  broken([](Vdi& v) { std::get<SupersegmentLists>(v.lists).offsets = {0, 3, 2}; });
  broken([](Vdi& v) { std::get<SupersegmentLists>(v.lists).segments[1].front = 1.5F; });
  broken([](Vdi& v) { std::get<SupersegmentLists>(v.lists).segments[0].back = 1.0F; });
  broken([](Vdi& v) { std::get<SupersegmentLists>(v.lists).segments[0].opacity = 0.0F; });
  broken([](Vdi& v) {
    std::get<SupersegmentLists>(v.lists).segments[0].red = std::numeric_limits<float>::quiet_NaN();
  });
}

TEST_CASE("the level of a histogram gives lists the wanted total") {
  SupersegmentHistogram histogram;
  histogram.supersegments = {1000, 800, 600, 300, 200, 100, 50, 20, 10, 10};
  histogram.equally = 600;
  CHECK(histogram.levelFor(1.0) == 2.0F);
  CHECK(histogram.levelFor(0.75) == Approx(2.5F));  // 450
  CHECK(histogram.levelFor(0.001) == 9.0F);         // each list has at least one
  histogram.equally = 2000;
  CHECK(histogram.levelFor(1.0) == 0.0F);  // there are fewer samples than requested
  histogram.equally = 900;
  CHECK(histogram.levelFor(1.0) == Approx(0.5F));
  SupersegmentHistogram twice = histogram;
  twice += histogram;
  CHECK(twice.levelFor(0.3) == histogram.levelFor(0.3));
  CHECK(SupersegmentHistogram().levelFor(1.0) == 0.0F);
  const auto countAt = [](std::size_t level) { return std::array{40, 30, 20, 15, 12, 9, 6, 3, 2, 1}[level]; };
  CHECK(supersegmentsAt(0.0F, 0.5F, countAt) == 40);
  CHECK(supersegmentsAt(1.5F, 0.5F, countAt) == 25);
  CHECK(supersegmentsAt(9.0F, 0.5F, countAt) == 1);
  CHECK(supersegmentsAt(8.9F, 0.5F, countAt) == 1);
  double sum = 0.0;
  for (std::uint32_t i = 0; i < 1000; ++i) sum += supersegmentsAt(5.25F, roundingOf(i), countAt);
  CHECK(sum / 1000.0 == Approx(8.25).epsilon(0.01));
}

TEST_CASE("invalid budgets and fills are refused") {
  GenerateSettings settings;
  settings.budget = Budget::Total;
  settings.fill = 0.5;
  CHECK_NOTHROW(validate(settings));
  settings.algorithm = Algorithm::Bisection;
  CHECK_THROWS_AS(validate(settings), Error);
  settings.algorithm = Algorithm::Merge;
  settings.fill = 0.0;
  CHECK_THROWS_AS(validate(settings), Error);
  settings.fill = 0.5;
  settings.budget = Budget::List;
  CHECK_THROWS_AS(validate(settings), Error);
  CHECK(maxPerList(25, Budget::List) == 25);
  CHECK(maxPerList(25, Budget::Total) == 50);
  CHECK(maxPerList(1000, Budget::Total) == maxSupersegments);
}

TEST_CASE("box faces: points are inside exactly where all six say so; an empty box is all space") {
  const Box box{{-1.0, 2.0, 0.5}, {3.0, 2.5, 4.0}};
  Camera camera = Camera::framing(box, {-0.5, -0.35, -1.0}, {0.2, 1.0, 0.0});
  camera.parallelProjection = GENERATE(false, true);
  const View view(camera, 30, 20);
  const auto isInside = [&](const Box& of, const glm::dvec3& world) {
    const BoxFaces faces = facesOf(of, view);
    return std::all_of(faces.begin(), faces.end(), [&](const glm::dvec4& face) {
      return glm::dot(glm::dvec3(face), view.toView(world)) >= face.w;
    });
  };
  for (int i = 0; i < 27; ++i) {
    const glm::dvec3 share = glm::dvec3(i % 3, i / 3 % 3, i / 9) * 0.7 - 0.2;  // as a share of the box's size
    CHECK(isInside(box, box.lo + share * box.size()) == (i == 13));
    CHECK(isInside(Box{}, box.lo + share * box.size()));
  }
}

TEST_CASE("the table of settings: each row has a member of its own, a range and a valid default") {
  for (const Setting& setting : settingsTable()) {
    INFO(setting.name);
    CHECK(&settingsTable()[indexOfSetting(setting.property)] == &setting);
    GenerateSettings settings;
    const double standard = setting.get(settings);
    CHECK_NOTHROW(setting.check(standard));
    const double other = standard == setting.high ? std::max(setting.low, 0.5 * setting.high) : setting.high;
    setting.set(settings, setting.kind == Setting::Kind::Number ? other : std::floor(other));
    for (const Setting& each : settingsTable())
      CHECK((each.get(settings) != each.get(GenerateSettings())) == (&each == &setting));
    for (const double value : {setting.low - 1.0, setting.high + 1.0, std::nan("")}) {
      if (value != setting.automatic) CHECK_THROWS_AS(setting.set(settings, value), Error);
    }
    if (setting.kind != Setting::Kind::Number) CHECK_THROWS_AS(setting.set(settings, 0.5), Error);
  }
  CHECK(optionOf(settingsTable()[indexOfSetting("TerminationOpacity")]) == "--termination-opacity");
}

namespace {

/// An attribute of an XML element's beginning; nothing if there is none.
std::optional<std::string> attributeOf(const std::string& element, const std::string& name) {
  std::smatch found;
  if (!std::regex_search(element, found, std::regex("\\s" + name + "=\"([^\"]*)\""))) return std::nullopt;
  return found[1];
}

}  // namespace

TEST_CASE("the filter's numbers of the last VDI have room for each setting") {
  std::ifstream file(VDI_FILTER_XML);
  const std::string xml{std::istreambuf_iterator<char>(file), {}};
  const std::size_t begin = xml.find("VectorProperty name=\"LastVdi\"");
  REQUIRE(begin != std::string::npos);
  const std::string property = xml.substr(begin, xml.find('>', begin) - begin);
  CHECK(std::stoul(attributeOf(property, "number_of_elements").value()) == settingCount + 6);
  const std::string defaults = attributeOf(property, "default_values").value();
  CHECK(std::ranges::count(defaults, '0') == settingCount + 6);
}

TEST_CASE("the filter's properties have the ranges, names and defaults of the table of settings") {
  std::ifstream file(VDI_FILTER_XML);
  std::string xml{std::istreambuf_iterator<char>(file), {}};
  xml = xml.substr(xml.find("<VDIGeneratorProxy name=\"VolumetricDepthImage\""));
  GenerateSettings standard;
  standard.samplesPerVoxel = automaticRate;
  for (const Setting& setting : settingsTable()) {
    INFO(setting.property);
    const std::size_t begin = xml.find("VectorProperty name=\"" + std::string(setting.property) + "\"");
    REQUIRE(begin != std::string::npos);
    const std::string property = xml.substr(begin, xml.find("VectorProperty>", begin) - begin);
    CHECK(attributeOf(property, "command") == "Set" + std::string(setting.property));
    CHECK(std::stod(attributeOf(property, "default_values").value()) == setting.get(standard));
    if (setting.kind == Setting::Kind::Flag) {
      CHECK(property.find("<BooleanDomain") != std::string::npos);
    } else if (setting.kind == Setting::Kind::Name) {
      for (int value = 0; value <= static_cast<int>(setting.high); ++value) {
        std::string name = setting.nameOf(value);
        name[0] = static_cast<char>(std::toupper(name[0]));
        CHECK(property.find("<Entry text=\"" + name + "\" value=\"" + std::to_string(value) + "\"") !=
              std::string::npos);
      }
    } else {
      // A panel may offer less.
      const std::string domain = property.substr(property.find("Domain"));
      CHECK_NOTHROW(setting.check(std::stod(attributeOf(domain, "min").value())));
      CHECK_NOTHROW(setting.check(std::stod(attributeOf(domain, "max").value())));
    }
  }
}
