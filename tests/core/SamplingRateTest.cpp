#include "vdi/core/SamplingRate.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <vector>
#include "tests/Catch.h"

using namespace vdi;

namespace {

/// A ball in 40^3 points whose scalars fall from 1 to 0 over `width` voxels.
double ball(const glm::ivec3& index, double width) {
  return std::clamp((13.0 - glm::distance(glm::dvec3(index), glm::dvec3(19.5))) / width + 0.5, 0.0, 1.0);
}

/// A block of the ball's points [lo, hi], which owns the box between them.
template <typename Value>
Block part(const glm::ivec3& lo, const glm::ivec3& hi, const glm::ivec3& ghosts, Value value) {
  const glm::ivec3 first = glm::max(lo - ghosts, glm::ivec3(0));
  const glm::ivec3 last = glm::min(hi + ghosts, glm::ivec3(39));
  const glm::ivec3 dims = last - first + 1;
  auto values = std::make_shared<std::vector<float>>();
  for (int z = first.z; z <= last.z; ++z) {
    for (int y = first.y; y <= last.y; ++y) {
      for (int x = first.x; x <= last.x; ++x)
        values->push_back(static_cast<float>(value(glm::ivec3(x, y, z))));
    }
  }
  Block block = Block::fromPoints(dims, glm::dvec3(first), glm::dvec3(1.0), ScalarType::F32, values->data());
  block.owned = {glm::dvec3(lo), glm::dvec3(hi)};
  block.keepAlive = values;
  return block;
}

template <typename Value>
std::vector<Block> whole(Value value) {
  return {part(glm::ivec3(0), glm::ivec3(39), glm::ivec3(0), value)};
}

/// Hues that change `changes` times over [0, 1].
TransferFunction hues(int changes, double opacity) {
  TransferFunction function;
  for (int i = 0; i <= changes; ++i) {
    const double x = static_cast<double>(i) / changes;
    function.colors.push_back({x, {i % 3 == 0 ? 1.0 : 0.0, i % 3 == 1 ? 1.0 : 0.0, i % 3 == 2 ? 1.0 : 0.0}});
  }
  function.opacities = {{0.0, 0.0}, {0.5, 0.25 * opacity}, {1.0, opacity}};
  return function;
}

double rateOf(std::span<const Block> blocks, const TransferFunction& function, const Region& region = {}) {
  const Scene scene = localScene(blocks);
  return samplingRateFor(bake(function), scene, region, probesOf(scene, blocks));
}

}  // namespace

TEST_CASE("sampling rate: steep functions on sharp surfaces get more samples, and nothing else does") {
  const auto sharp = whole([](const glm::ivec3& at) { return ball(at, 1.0); });
  const auto soft = whole([](const glm::ivec3& at) { return ball(at, 12.0); });
  const auto even = whole([](const glm::ivec3&) { return 0.7; });
  CHECK(rateOf(sharp, hues(15, 0.6)) == 4.0);
  CHECK(rateOf(sharp, hues(2, 0.3)) == 2.0);
  CHECK(rateOf(sharp, hues(1, 0.02)) == 1.0);
  CHECK(rateOf(soft, hues(6, 0.6)) == 1.0);
  CHECK(rateOf(even, hues(15, 0.6)) == 1.0);
  CHECK(rateOf(sharp, hues(15, 0.0)) == 1.0);  // nothing is visible
  CHECK(rateOf({}, hues(15, 0.6)) == 1.0);
}

TEST_CASE("sampling rate: units of scalars and of the world don't matter") {
  auto blocks = whole([](const glm::ivec3& at) { return 1e6 + 1e3 * ball(at, 1.0); });
  blocks[0].spacing *= 1e-3;
  blocks[0].owned.hi *= 1e-3;
  TransferFunction function = hues(2, 0.3);
  for (ColorNode& node : function.colors) node.x = 1e6 + 1e3 * node.x;
  for (OpacityNode& node : function.opacities) node.x = 1e6 + 1e3 * node.x;
  function.unitDistance = 1e-3;
  CHECK(rateOf(blocks, function) == 2.0);
}

TEST_CASE("sampling rate: only the visible region counts") {
  const auto sharp = whole([](const glm::ivec3& at) { return ball(at, 1.0); });
  const TransferFunction function = hues(15, 0.6);
  Region inside;
  inside.box = Box{glm::dvec3(14.0), glm::dvec3(25.0)};
  CHECK(rateOf(sharp, function, inside) == 1.0);
  Region outside;
  outside.planes = {{glm::dvec3(36.0), {1.0, 0.0, 0.0}}};
  CHECK(rateOf(sharp, function, outside) == 1.0);
  outside.planes = {{glm::dvec3(19.5), {1.0, 0.0, 0.0}}};
  CHECK(rateOf(sharp, function, outside) > 1.0);
}

TEST_CASE("sampling rate: values that are not finite do not count") {
  const float infinity = std::numeric_limits<float>::infinity();
  const auto holes = whole([&](const glm::ivec3& at) {
    if (at.x % 5 == 0) return at.y % 2 == 0 ? std::nanf("") : infinity;
    return static_cast<float>(ball(at, 12.0));
  });
  CHECK(rateOf(holes, hues(6, 0.6)) == 1.0);
}

TEST_CASE("sampling rate: values far beyond the transfer function take no longer than others") {
  const auto far = whole([](const glm::ivec3& at) { return at.x % 5 == 0 ? -3e38 : 3e38 * ball(at, 12.0); });
  const double rate = rateOf(far, hues(6, 0.6));
  CHECK((rate == 1.0 || rate == 2.0 || rate == 4.0));
}

TEST_CASE("sampling rate: every decomposition has the same probes") {
  const auto value = [](const glm::ivec3& at) { return ball(at, 2.0) + 0.01 * std::sin(at.x * at.y + at.z); };
  const auto all = whole(value);
  const Scene scene = localScene(all);
  const std::vector<Probe> expected = probesOf(scene, all);
  CHECK(expected.size() > 8000);
  std::vector<Probe> probes;
  for (int z = 0; z < 39; z += 13) {
    for (int y = 0; y < 39; y += 20) {
      for (int x = 0; x < 39; x += 8) {
        const glm::ivec3 lo{x, y, z};
        const glm::ivec3 hi = glm::min(lo + glm::ivec3(8, 20, 13), glm::ivec3(39));
        const std::vector<Block> own{part(lo, hi, glm::ivec3(1), value)};
        const std::vector<Probe> some = probesOf(scene, own);  // as on a rank without other blocks
        probes.insert(probes.end(), some.begin(), some.end());
      }
    }
  }
  std::ranges::sort(probes, {}, &Probe::index);
  REQUIRE(probes.size() == expected.size());
  double worst = 0.0;
  bool equal = true;
  for (std::size_t i = 0; i < probes.size(); ++i) {
    equal = equal && probes[i].index == expected[i].index;
    for (std::size_t j = 0; j < probes[i].scalars.size(); ++j)
      worst = std::max(worst, std::abs(probes[i].scalars[j] - expected[i].scalars[j]));
  }
  CHECK(equal);
  CHECK(worst < 1e-9);
}

TEST_CASE("a range that most values fill little of") {
  const auto crowded = [](double low, double high, const std::function<double(std::size_t)>& valueOf) {
    std::vector<Probe> probes(1000);
    for (std::size_t i = 0; i < probes.size(); ++i) probes[i].value = valueOf(i);
    return crowdedPart({low, high}, probes);
  };
  const auto part = crowded(0.0, 1e20, [](std::size_t i) { return i % 200 == 0 ? 1e20 : double(i % 97); });
  REQUIRE(part.has_value());
  CHECK(part->min >= 0.0);
  CHECK(part->max <= 96.0);
  CHECK(describeCrowded({0.0, 1e20}, *part).find("1e+20") != std::string::npos);
  // Fill values at an end of the range, however many they are.
  CHECK(crowded(-9999.0, 30.0, [](std::size_t i) { return i % 3 == 0 ? -9999.0 : double(i % 30); }));
  CHECK(crowded(-5.0, 65535.0, [](std::size_t i) { return i % 3 == 0 ? 65535.0 : double(i % 30); }));
  CHECK_FALSE(crowded(0.0, 255.0, [](std::size_t i) { return double(i % 256); }));
  CHECK_FALSE(crowded(0.0, 1.0, [](std::size_t i) { return double(i % 2); }));             // a mask
  CHECK_FALSE(crowded(0.0, 1.0, [](std::size_t i) { return i % 500 == 0 ? 1.0 : 0.0; }));  // an object in air
  CHECK_FALSE(crowded(0.0, 1.0, [](std::size_t) { return std::numeric_limits<double>::quiet_NaN(); }));
}
