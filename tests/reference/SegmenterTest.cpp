// How intervals become supersegments, on lists small enough to be followed by hand.
#include "vdi/reference/Segmenter.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

using namespace vdi;
using namespace vdi::reference;

namespace {

Interval sample(int k, float red, float opacity) {
  const auto front = static_cast<float>(k);
  return {front, front + 1.0F, red * opacity, 0.0F, 0.0F, opticalDepthOf(opacity)};
}

float transmittance(const std::vector<Supersegment>& list) {
  float t = 1.0F;
  for (const Supersegment& s : list) t *= 1.0F - s.opacity;
  return t;
}

}  // namespace

TEST_CASE("opacity and optical depth are inverse to each other, small values included") {
  for (const float opacity : {1e-7F, 1e-4F, 0.01F, 0.5F, 0.999F}) {
    CHECK(opacityOf(opticalDepthOf(opacity)) == Approx(opacity).epsilon(1e-4));
  }
  CHECK(opacityOf(opticalDepthOf(1.0F)) == 1.0F);
}

TEST_CASE("equal samples make one supersegment, whatever their number") {
  std::vector<Interval> samples;
  for (int k = 0; k < 40; ++k) samples.push_back(sample(k, 0.5F, 0.1F));
  const auto list = segmentByBisection(samples, {4, 1.0F, false});
  REQUIRE(list.size() == 1);
  CHECK(list[0].front == 0.0F);
  CHECK(list[0].back == 40.0F);
  CHECK(list[0].opacity == Approx(1.0 - std::pow(0.9, 40)).epsilon(1e-4));
}

TEST_CASE("transparent samples open nothing, may be absorbed, and are trimmed at the end") {
  const std::vector<Interval> samples{sample(0, 0.0F, 0.0F), sample(1, 1.0F, 0.5F), sample(2, 0.0F, 0.0F),
                                      sample(3, 1.0F, 0.5F), sample(4, 0.0F, 0.0F)};
  const auto apart = segmentWithSensitivity(samples, 0.01F, {9, 1.0F, false});
  REQUIRE(apart.size() == 2);
  CHECK(apart[0].front == 1.0F);
  CHECK(apart[0].back == 2.0F);
  const auto together = segmentWithSensitivity(samples, 2.0F, {9, 1.0F, false});
  REQUIRE(together.size() == 1);
  CHECK(together[0].front == 1.0F);
  CHECK(together[0].back == 4.0F);
  CHECK(together[0].opacity == Approx(0.75F));
}

TEST_CASE("gaps end a supersegment where another rank may have material, and only there") {
  const std::vector<Interval> samples{sample(0, 1.0F, 0.5F), sample(5, 1.0F, 0.5F)};
  CHECK(segmentWithSensitivity(samples, 2.0F, {9, 1.0F, true}).size() == 2);
  CHECK(segmentWithSensitivity(samples, 2.0F, {9, 1.0F, false}).size() == 1);
  CHECK(segmentByBisection(samples, {1, 1.0F, true}).size() == 2);  // runs come before the budget
}

TEST_CASE("no more intervals than the budget: nothing is merged") {
  const std::vector<Interval> samples{sample(0, 0.5F, 0.3F), sample(1, 0.5F, 0.3F), sample(2, 0.5F, 0.3F)};
  CHECK(segmentByBisection(samples, {3, 1.0F, false}).size() == 3);
}

TEST_CASE("a list never exceeds its budget, fills most of it, and composites to the same picture") {
  std::mt19937 generator(5);
  std::uniform_real_distribution<float> uniform(0.0F, 1.0F);
  constexpr int rounds = 40;
  for (const std::uint32_t budget : {1U, 2U, 7U, 25U}) {
    std::size_t stored = 0;
    for (int round = 0; round < rounds; ++round) {
      std::vector<Interval> samples;
      float expected = 1.0F;
      for (int k = 0; k < 200; ++k) {
        const float opacity = uniform(generator) < 0.3F ? 0.0F : 0.05F * uniform(generator);
        samples.push_back(sample(k, uniform(generator), opacity));
        expected *= 1.0F - opacity;
      }
      const auto list = segmentByBisection(samples, {budget, 1.0F, false});
      CHECK(list.size() <= budget);
      CHECK_FALSE(list.empty());
      stored += list.size();
      CHECK(transmittance(list) == Approx(expected).epsilon(1e-3));
    }
    CHECK(stored >= rounds * budget * 2 / 3);
  }
}

TEST_CASE("the criterion does not depend on the length of a sample") {
  std::vector<Interval> once;
  std::vector<Interval> scaled;
  for (int k = 0; k < 60; ++k) {
    once.push_back(sample(k, 0.5F + 0.5F * std::sin(0.3F * static_cast<float>(k)), 0.05F));
    scaled.push_back(once.back());
    scaled.back().front *= 1e6F;
    scaled.back().back *= 1e6F;
  }
  CHECK(segmentByBisection(once, {8, 1.0F, false}).size() ==
        segmentByBisection(scaled, {8, 1e6F, false}).size());
}
