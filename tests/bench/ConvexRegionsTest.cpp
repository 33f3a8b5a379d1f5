// The order of boxes that planes separate: each ray must meet the boxes in that order.
#include <algorithm>
#include <limits>
#include <random>
#include <span>
#include <vector>

#include "bench/ConvexRegions.h"
#include "tests/Catch.h"

using namespace vdi;
using bench::SeparatingPlanes;

namespace {

/// The places at which a line enters and leaves a box, in units of `direction`. `enter` exceeds `leave` if
/// the line misses the box.
struct Span {
  double enter = -std::numeric_limits<double>::infinity();
  double leave = std::numeric_limits<double>::infinity();
};

Span spanOf(const Box& box, const glm::dvec3& origin, const glm::dvec3& direction) {
  Span span;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (box.lo[axis] - origin[axis]) / direction[axis];
    const double b = (box.hi[axis] - origin[axis]) / direction[axis];
    span.enter = std::max(span.enter, std::min(a, b));
    span.leave = std::min(span.leave, std::max(a, b));
  }
  return span;
}

Box boxOf(const IndexBox& box) {
  return box.empty() ? Box{} : Box{glm::dvec3(box.lo), glm::dvec3(box.hi)};
}

}  // namespace

TEST_CASE("k-d cuts fill the lattice, without overlap, in parts of like size") {
  for (const int parts : {1, 2, 3, 5, 8, 13, 64}) {
    const glm::ivec3 size(40, 30, 20);
    const std::vector<IndexBox> cuts = bench::kdCuts(size, parts);
    REQUIRE(cuts.size() == static_cast<std::size_t>(parts));
    std::size_t filled = 0;
    for (std::size_t i = 0; i < cuts.size(); ++i) {
      filled += cuts[i].count();
      CHECK(cuts[i].count() * static_cast<std::size_t>(parts) < 2 * 40 * 30 * 20);
      for (std::size_t j = 0; j < i; ++j) CHECK(cuts[i].intersection(cuts[j]).empty());
    }
    CHECK(filled == 40 * 30 * 20);
  }
}

TEST_CASE("k-d cuts of fewer steps than parts: some get nothing, nothing is lost") {
  const std::vector<IndexBox> cuts = bench::kdCuts({2, 1, 1}, 5);
  std::size_t filled = 0;
  for (const IndexBox& cut : cuts) filled += cut.count();
  CHECK(cuts.size() == 5);
  CHECK(filled == 2);
}

TEST_CASE("rays meet boxes in the order that is told") {
  std::mt19937 generator(7);
  std::uniform_real_distribution<double> anywhere(-30.0, 70.0);
  std::uniform_real_distribution<double> inside(0.0, 40.0);
  for (const int parts : {2, 5, 16}) {
    std::vector<Box> boxes;
    for (const IndexBox& cut : bench::kdCuts({40, 30, 20}, parts)) boxes.push_back(boxOf(cut));
    boxes.insert(boxes.begin() + 1, Box());  // a rank without blocks
    const auto planes = SeparatingPlanes::between(boxes, 1e-6);
    REQUIRE(planes);
    int pairs = 0;
    for (int round = 0; round < 200; ++round) {
      Camera camera;
      camera.position = {anywhere(generator), anywhere(generator), anywhere(generator)};
      camera.focalPoint = {inside(generator), inside(generator), inside(generator)};
      camera.parallelProjection = round % 2 == 1;
      const std::vector<int> order = planes->frontToBack(camera);
      std::vector<int> sorted = order;
      std::sort(sorted.begin(), sorted.end());
      REQUIRE(sorted.size() == boxes.size());
      for (std::size_t i = 0; i < sorted.size(); ++i) REQUIRE(sorted[i] == static_cast<int>(i));
      for (int ray = 0; ray < 20; ++ray) {
        glm::dvec3 origin = camera.position;
        glm::dvec3 direction = camera.focalPoint - camera.position;
        const glm::dvec3 aside{inside(generator), inside(generator), inside(generator)};
        if (camera.parallelProjection) {
          origin = aside - direction;
        } else {
          direction = aside - origin;
        }
        double reached = 0.0;  // in front of the camera
        for (const int index : order) {
          const Span span = spanOf(boxes[static_cast<std::size_t>(index)], origin, direction);
          if (boxes[static_cast<std::size_t>(index)].empty() || span.leave <= std::max(span.enter, 0.0))
            continue;
          const double enter = std::max(span.enter, 0.0);
          if (enter < reached - 1e-9) FAIL("parts " << parts << ", round " << round);
          pairs += reached > 0.0 ? 1 : 0;
          reached = enter;
        }
      }
    }
    CHECK(pairs > 100);
  }
}

TEST_CASE("boxes that no plane separates have no order") {
  const Box lower{{0.0, 0.0, 0.0}, {2.0, 2.0, 2.0}};
  CHECK_FALSE(SeparatingPlanes::between(std::vector<Box>{lower, {{1.0, 1.0, 1.0}, {3.0, 3.0, 3.0}}}, 1e-6));
  // A pinwheel: disjoint, but every plane cuts one of them.
  const std::vector<Box> pinwheel{{{0.0, 0.0, 0.0}, {2.0, 1.0, 1.0}},
                                  {{2.0, 0.0, 0.0}, {3.0, 2.0, 1.0}},
                                  {{1.0, 2.0, 0.0}, {3.0, 3.0, 1.0}},
                                  {{0.0, 1.0, 0.0}, {1.0, 3.0, 1.0}}};
  CHECK_FALSE(SeparatingPlanes::between(pinwheel, 1e-6));
  CHECK(SeparatingPlanes::between(std::span(pinwheel).first(3), 1e-6));
}
