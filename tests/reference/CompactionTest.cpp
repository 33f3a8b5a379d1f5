// Supersegments in codes: their distance from the floats that they represent.
#include "tests/Catch.h"
#include "vdi/reference/Compaction.h"

#include <cmath>
#include <random>

#include "vdi/core/Scene.h"
#include "vdi/core/Vdi.h"

using namespace vdi;
using namespace vdi::reference;

namespace {

constexpr DepthCode code{2.0F, 0.01F};

std::vector<Interval> randomList(std::mt19937& random, int count, float thickest) {
  std::uniform_real_distribution<float> unit(0.0F, 1.0F);
  std::vector<Interval> list;
  float depth = 2.0F;
  for (int i = 0; i < count; ++i) {
    const float front = depth + (unit(random) < 0.5F ? 0.0F : 0.2F * unit(random));
    depth = front + 0.02F + 0.2F * unit(random);
    // From almost transparent to opaque, evenly in the exponent.
    const float opticalDepth = thickest * std::exp2(-14.0F * unit(random));
    const float opacity = opacityOf(opticalDepth);
    list.push_back(
        {front, depth, unit(random) * opacity, unit(random) * opacity, unit(random) * opacity, opticalDepth});
  }
  return list;
}

struct SeenLight {
  float color[3] = {0.0F, 0.0F, 0.0F};
  float transmittance = 1.0F;
  void add(float red, float green, float blue, float opacity) {
    color[0] += transmittance * red;
    color[1] += transmittance * green;
    color[2] += transmittance * blue;
    transmittance *= 1.0F - opacity;
  }
};

}  // namespace

TEST_CASE("codes of optical depth: ascending, positive, each its own") {
  for (std::uint32_t c = 0; c < 4095; ++c) CHECK(opticalDepthOfCode(c) < opticalDepthOfCode(c + 1));
  CHECK(opticalDepthOfCode(0) > 0.0F);
  CHECK(opacityOf(opticalDepthOfCode(4095)) == 1.0F);
}

TEST_CASE("every field of a compact supersegment is its own") {
  const auto s = CompactSupersegment::pack(0x3ffe, 0x3fff, 1, 2, 255, 0xffe);
  CHECK(s.front() == 0x3ffe);
  CHECK(s.back() == 0x3fff);
  CHECK(s.color(0) == 1);
  CHECK(s.color(1) == 2);
  CHECK(s.color(2) == 255);
  CHECK(s.opticalDepth() == 0xffe);
}

TEST_CASE("V_O sees a list within 1/255, however long, thin or dense; no supersegment is far from itself") {
  std::mt19937 random(5);
  const float thickest = GENERATE(0.01F, 0.3F, 4.0F, 60000.0F);
  for (int trial = 0; trial < 200; ++trial) {
    const std::vector<Interval> list = randomList(random, 1 + trial % 40, thickest);
    const std::vector<CompactSupersegment> codes = compacted(list, code);
    REQUIRE(codes.size() == list.size());
    SeenLight expected;
    SeenLight seen;
    for (std::size_t i = 0; i < list.size(); ++i) {
      const Supersegment s = expanded(codes[i], code);
      const Interval& own = list[i];
      expected.add(own.red, own.green, own.blue, opacityOf(own.opticalDepth));
      seen.add(s.red, s.green, s.blue, s.opacity);
      CHECK(std::abs(s.front - own.front) <= 0.51F * code.step);
      CHECK(std::abs(s.back - own.back) <= 0.51F * code.step);
      CHECK(std::abs(s.opacity - opacityOf(own.opticalDepth)) < 0.25F * own.opticalDepth + 0.002F);
    }
    for (int c = 0; c < 3; ++c) CHECK(std::abs(expected.color[c] - seen.color[c]) < 1.0F / 255.0F);
    CHECK(std::abs(expected.transmittance - seen.transmittance) < 1.0F / 255.0F);
  }
}

TEST_CASE("codes of codes are the same codes") {
  std::mt19937 random(9);
  for (int trial = 0; trial < 50; ++trial) {
    CompactLists lists;
    const std::vector<CompactSupersegment> codes = compacted(randomList(random, 20, 2.0F), code);
    lists.segments.assign(codes.begin(), codes.end());
    lists.offsets = {0, 20};
    const CompactLists again = compacted(expanded(lists, code), code);
    for (std::size_t i = 0; i < 20; ++i) {
      CHECK(again.segments[i].front() == lists.segments[i].front());
      CHECK(again.segments[i].back() == lists.segments[i].back());
      CHECK(again.segments[i].opticalDepth() == lists.segments[i].opticalDepth());
    }
  }
}

TEST_CASE("depth codes: none for lattices that do not fit, separate samples in those that do") {
  CHECK(depthCodeFor({1.0, 0.1, 8191}) == DepthCode{});
  CHECK(depthCodeFor({1.0, 0.0, 0}) == DepthCode{});
  CHECK_FALSE(DepthCode{}.exists());
  for (const std::uint32_t count : {1U, 7U, 1000U, 8190U}) {
    const DepthLattice lattice{1.5, 0.25, count};
    const DepthCode own = depthCodeFor(lattice);
    REQUIRE(own.exists());
    CHECK(own.step <= 0.125F);
    CHECK(own.depthOf(DepthCode::largest) >= static_cast<float>(lattice.frontOf(count)));
    const auto front = static_cast<float>(lattice.frontOf(count - 1));
    const auto back = static_cast<float>(lattice.frontOf(count));
    const auto list = compacted(std::vector<Interval>{{front, back, 0.1F, 0.1F, 0.1F, 1.0F}}, own);
    CHECK(expanded(list[0], own).front == Approx(front).epsilon(1e-5));
    CHECK(expanded(list[0], own).back == Approx(back).epsilon(1e-5));
  }
}
