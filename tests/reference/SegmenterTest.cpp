// Turns intervals into supersegments, on lists small enough to follow by hand.
#include "tests/Catch.h"
#include "vdi/reference/Segmenter.h"

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

TEST_CASE("both algorithms: equal samples make one supersegment, whatever their number") {
  std::vector<Interval> samples;
  for (int k = 0; k < 40; ++k) samples.push_back(sample(k, 0.5F, 0.1F));
  for (const Algorithm algorithm : {Algorithm::Merge, Algorithm::Bisection}) {
    const auto list = segment(samples, {4, 1.0F, false}, algorithm);
    REQUIRE(list.size() == 1);
    CHECK(list[0].front == 0.0F);
    CHECK(list[0].back == 40.0F);
    CHECK(list[0].opacity == Approx(1.0 - std::pow(0.9, 40)).epsilon(1e-4));
  }
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
  for (const Algorithm algorithm : {Algorithm::Merge, Algorithm::Bisection}) {
    CHECK(segment(samples, {1, 1.0F, true}, algorithm).size() == 2);  // runs take precedence over the budget
    CHECK(segment(samples, {1, 1.0F, false}, algorithm).size() == 1);
  }
}

TEST_CASE("no more intervals than the budget: nothing is merged") {
  const std::vector<Interval> samples{sample(0, 0.5F, 0.3F), sample(1, 0.5F, 0.3F), sample(2, 0.5F, 0.3F)};
  for (const Algorithm algorithm : {Algorithm::Merge, Algorithm::Bisection})
    CHECK(segment(samples, {3, 1.0F, false}, algorithm).size() == 3);
}

TEST_CASE("a list never exceeds its budget, fills most of it, and composites to the same picture") {
  const Algorithm algorithm = GENERATE(Algorithm::Merge, Algorithm::Bisection);
  INFO(toString(algorithm));
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
      const auto list = segment(samples, {budget, 1.0F, false}, algorithm);
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
  for (const Algorithm algorithm : {Algorithm::Merge, Algorithm::Bisection}) {
    CHECK(segment(once, {8, 1.0F, false}, algorithm).size() ==
          segment(scaled, {8, 1e6F, false}, algorithm).size());
  }
}

TEST_CASE("merging fills the list where bisection collapses: bands of one value each") {
  // Thin bands, all equal: at any sensitivity, either all stay apart or all merge.
  std::vector<Interval> samples;
  for (int k = 0; k < 300; ++k) samples.push_back(sample(k, 1.0F, k % 3 == 0 ? 0.02F : 0.0F));
  CHECK(segmentByMerging(samples, {25, 1.0F, false}).size() == 25);
  CHECK(segmentByBisection(samples, {25, 1.0F, false}).size() == 1);
}

TEST_CASE("merging keeps distinct material and joins similar") {
  std::vector<Interval> samples;
  for (int k = 0; k < 60; ++k)
    samples.push_back(
        sample(k, k == 30 ? 1.0F : 0.2F + 0.001F * static_cast<float>(k % 2), k == 30 ? 0.8F : 0.02F));
  const auto list = segmentByMerging(samples, {3, 1.0F, false});
  REQUIRE(list.size() == 3);
  CHECK(list[1].front == 30.0F);
  CHECK(list[1].back == 31.0F);
}

TEST_CASE(
    "far apart, merging leaves emptiness empty, light where most of it was, and the list's first depth") {
  // Faint ones in front of a bright one and behind it.
  const std::vector<Interval> samples{sample(0, 0.5F, 0.001F), sample(40, 0.5F, 0.5F),
                                      sample(100, 0.5F, 0.002F)};
  const auto list = segmentByMerging(samples, {2, 1.0F, false});
  REQUIRE(list.size() == 2);
  CHECK(list[0].front == 0.0F);
  CHECK(list[0].back == 1.0F);
  CHECK(list[1].front == 40.0F);
  CHECK(list[1].back == 41.0F);
  const auto two = segmentByMerging({samples.data() + 1, 2}, {1, 1.0F, false});
  REQUIRE(two.size() == 1);
  CHECK(two[0].front == 40.0F);
  CHECK(two[0].back == 41.0F);
  CHECK(transmittance(two) == Approx(0.5F * 0.998F));
  // With material in front of it, the fainter one may move to the one behind.
  const std::vector<Interval> faintFirst{sample(0, 0.5F, 0.4F), sample(50, 0.5F, 0.001F),
                                         sample(90, 0.5F, 0.4F)};
  const auto behind = segmentByMerging(faintFirst, {2, 1.0F, false});
  REQUIRE(behind.size() == 2);
  CHECK(behind[0].back - behind[0].front == 1.0F);
  CHECK(behind[1].back - behind[1].front == 1.0F);
  CHECK(transmittance(behind) == Approx(0.6F * 0.999F * 0.6F));
  // Close to each other, they merge.
  const std::vector<Interval> near{sample(0, 0.5F, 0.4F), sample(2, 0.5F, 0.01F)};
  const auto joined = segmentByMerging(near, {1, 1.0F, false});
  REQUIRE(joined.size() == 1);
  CHECK(joined[0].back == 3.0F);
}

TEST_CASE("merging never joins across kept gaps") {
  std::vector<Interval> samples;
  for (int k = 0; k < 40; ++k)
    samples.push_back(sample(k + k / 10, 0.5F, 0.01F * static_cast<float>(1 + k % 4)));
  const auto list = segmentByMerging(samples, {5, 1.0F, true});
  REQUIRE(list.size() == 5);
  std::size_t ends = 0;
  for (const Supersegment& s : list) {
    for (const float gap : {10.0F, 21.0F, 32.0F}) {
      CHECK_FALSE((s.front < gap && s.back > gap + 1.0F));
      ends += s.back == gap ? 1 : 0;
    }
  }
  CHECK(ends == 3);
  CHECK(segmentByMerging(samples, {2, 1.0F, true}).size() == 4);  // as many as runs
}

TEST_CASE("a list that wasn't counted fits however wrong its interpolated tolerance is, and loses no light") {
  std::mt19937 generator(3);
  std::uniform_real_distribution<float> uniform(0.0F, 1.0F);
  std::vector<Interval> samples;
  float expected = 1.0F;
  for (int k = 0; k < 300; ++k) {
    const float opacity = uniform(generator) < 0.2F ? 0.0F : 0.03F * uniform(generator);
    samples.push_back(sample(k, uniform(generator), opacity));
    expected *= 1.0F - opacity;
  }
  const SegmentRules rules{100, 1.0F, false};
  for (const std::uint32_t preSegments : {0U, 3U, 40U}) {
    const ListTolerance neighbours[] = {{-1.0F, preSegments, preSegments + sparePreSegments}, {}};
    const ListTolerance guessed = interpolatedTolerance(neighbours);
    CHECK(guessed.room >= preSegments + uncountedSparePreSegments);
    const auto list = segmentByMerging(samples, rules, guessed);
    CHECK(list.size() <= guessed.room);
    CHECK(list.size() >= guessed.room / 2);
    CHECK(transmittance(list) == Approx(expected).epsilon(1e-3));
  }
  // Between empty lists, there is still room for something small.
  const ListTolerance nothing[] = {{}, {}};
  CHECK(segmentByMerging({samples.data(), 3}, rules, interpolatedTolerance(nothing)).size() >= 2);
  CHECK(segmentByMerging(samples, rules, ListTolerance()).empty());  // known to be empty
}

TEST_CASE(
    "an interpolated tolerance between counted lists: the mean of their tolerances, room for the most "
    "pre-segments") {
  const ListTolerance counted[] = {{0.01F, 20, 24}, {0.04F, 30, 34}, {}, {0.02F, 10, 14}};
  const ListTolerance between = interpolatedTolerance(counted);
  CHECK(between.tolerance == Approx(0.02F));
  CHECK(between.preSegments == 30);
  CHECK(between.room == 30 + uncountedSparePreSegments + 7);
}
