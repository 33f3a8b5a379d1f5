// Colorings for legends: fewer nodes, the same function.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "tests/Catch.h"
#include "vdi/core/Coloring.h"
#include "vdi/core/Error.h"

using namespace vdi;

namespace {

/// The largest difference of a channel, at and between the nodes of `function`.
double apart(const TransferFunction& function, const TransferFunction& other) {
  double largest = 0.0;
  for (std::size_t i = 0; i + 1 < function.colors.size(); ++i) {
    for (const double share : {0.0, 0.3, 0.9}) {
      const double x = function.colors[i].x * (1.0 - share) + function.colors[i + 1].x * share;
      const glm::dvec3 difference = glm::abs(function.colorAt(x) - other.colorAt(x));
      largest = std::max({largest, difference.r, difference.g, difference.b});
    }
  }
  return largest;
}

TransferFunction sampled(int count, const std::function<glm::dvec3(double)>& color) {
  TransferFunction function;
  for (int i = 0; i < count; ++i) {
    const double x = static_cast<double>(i) / (count - 1);
    function.colors.push_back({-5.0 + 10.0 * x, color(x)});
  }
  function.opacities = {{-5.0, 0.0}, {0.0, 0.0}, {5.0, 1.0}};
  function.unitDistance = 3.0;
  return function;
}

}  // namespace

TEST_CASE("a smooth map needs few nodes, a ramp two") {
  const TransferFunction smooth =
      sampled(1025, [](double x) { return glm::dvec3(x * x, 0.5 + 0.5 * std::sin(6.0 * x), std::sqrt(x)); });
  const TransferFunction few = simplified(smooth);
  CHECK(few.colors.size() < 60);
  CHECK(few.colors.front().x == -5.0);
  CHECK(few.colors.back().x == 5.0);
  CHECK(few.opacities == smooth.opacities);
  CHECK(few.unitDistance == 3.0);
  CHECK(apart(smooth, few) <= 1.0 / 512.0);
  CHECK(simplified(sampled(1025, [](double x) { return glm::dvec3(x, 0.0, 1.0 - x); })).colors.size() == 2);
}

TEST_CASE("steps stay steps") {
  TransferFunction steps;
  for (int i = 0; i < 8; ++i) {
    const glm::dvec3 color(i % 2, 0.125 * i, 1.0);
    for (int k = 0; k < 10; ++k) steps.colors.push_back({i + k / 9.0, color});
  }
  steps.opacities = {{0.0, 0.0}, {4.0, 0.0}, {4.0, 1.0}, {8.0, 1.0}};
  const TransferFunction few = simplified(steps);
  CHECK(few.colors.size() == 16);
  CHECK(apart(steps, few) <= 1.0 / 512.0);
  CHECK(few.opacities == steps.opacities);
}

TEST_CASE("no function has more nodes than a legend supports") {
  const TransferFunction noisy =
      sampled(20000, [](double x) { return glm::dvec3(0.5 + 0.5 * std::sin(1e6 * x)); });
  CHECK(simplified(noisy).colors.size() <= 4096);
  TransferFunction atOnePlace = sampled(2, [](double) { return glm::dvec3(0.0); });
  atOnePlace.opacities.assign(20000, {1.0, 0.5});
  CHECK(simplified(atOnePlace).opacities.size() == 2);
}

TEST_CASE("an invalid coloring is refused") {
  Coloring sound;
  sound.array.components = 3;
  sound.array.component = -1;
  sound.range = {0.0, 1.0};
  sound.function = sampled(3, [](double x) { return glm::dvec3(x); });
  CHECK_NOTHROW(validate(sound));
  const auto refused = [&sound](auto spoil) {
    Coloring coloring = sound;
    spoil(coloring);
    try {
      validate(coloring);
    } catch (const Error& error) {
      return error.code() == ErrorCode::Format;
    }
    return false;
  };
  CHECK(refused([](Coloring& c) { c.array.component = 3; }));
  CHECK(refused([](Coloring& c) { c.array.component = -2; }));
  CHECK(refused([](Coloring& c) { c.array.components = 0; }));
  CHECK(refused([](Coloring& c) { c.range = {1.0, 0.0}; }));
  CHECK(refused([](Coloring& c) { c.range.max = std::numeric_limits<double>::infinity(); }));
  CHECK(refused([](Coloring& c) { c.function.colors.clear(); }));
}
