// The optical model in double precision, compared with results worked out by hand.
#include "tests/Catch.h"
#include "vdi/reference/Exact.h"

#include <cmath>

using namespace vdi;
using namespace vdi::reference;

namespace {

/// A volume whose scalar is z, from 0 to 1.
ExactVolume ramp() {
  return {{2, 2, 2},
          glm::dvec3(0.0),
          glm::dvec3(1.0),
          {glm::dvec3(0.0), glm::dvec3(1.0)},
          {0, 0, 0, 0, 1, 1, 1, 1}};
}

constexpr glm::dvec3 frontPoint{0.3, 0.6, 0.0};
constexpr glm::dvec3 back{0.3, 0.6, 1.0};

}  // namespace

TEST_CASE("exact: trilinear between values, constant beyond them") {
  ExactVolume volume{{2, 2, 2}, {1.0, 2.0, 3.0}, {2.0, 1.0, 0.5}, {}, {}};
  for (int i = 0; i < 8; ++i)
    volume.values.push_back((i & 1) + 10.0 * ((i >> 1) & 1) + 100.0 * ((i >> 2) & 1));
  CHECK(volume.at({1.0, 2.0, 3.0}) == 0.0);
  CHECK(volume.at({3.0, 3.0, 3.5}) == 111.0);
  CHECK(volume.at({1.5, 2.5, 3.375}) == Approx(0.25 + 5.0 + 75.0));
  CHECK(volume.at({-9.0, 9.0, 3.0}) == 10.0);
}

TEST_CASE("exact: a ray through one material loses light by its length in unit distances") {
  const TransferFunction function{{{0.0, {0.2, 0.4, 1.0}}}, {{0.0, 0.3}}, 0.25};
  const glm::dvec4 seen = integrate(ramp(), function, frontPoint, back, 7);
  const double opacity = 1.0 - std::pow(0.7, 4.0);
  CHECK(seen.a == Approx(opacity));
  CHECK(seen.r == Approx(0.2 * opacity));
  CHECK(seen.b == Approx(opacity));
}

TEST_CASE("exact: what is in front hides what is behind") {
  // Red up to the middle, then green.
  const TransferFunction function{
      {{0.0, {1, 0, 0}}, {0.5, {1, 0, 0}}, {0.5, {0, 1, 0}}, {1.0, {0, 1, 0}}}, {{0.0, 0.5}}, 0.5};
  const glm::dvec4 forth = integrate(ramp(), function, frontPoint, back, 64);
  CHECK(forth.r == Approx(0.5));
  CHECK(forth.g == Approx(0.25));
  const glm::dvec4 returned = integrate(ramp(), function, back, frontPoint, 64);
  CHECK(returned.r == Approx(0.25));
  CHECK(returned.g == Approx(0.5));
}

TEST_CASE("exact: opacity that rises along the ray") {
  // Optical depth per unit is -ln(1 - z): its integral from 0 to 1 is 1.
  const TransferFunction function{{{0.0, {1, 1, 1}}}, {{0.0, 0.0}, {1.0, 1.0}}, 1.0};
  CHECK(integrate(ramp(), function, frontPoint, back, 100000).a ==
        Approx(1.0 - std::exp(-1.0)).epsilon(1e-4));
}

TEST_CASE("exact: pictures are by VTK's cameras, rows from below") {
  const ExactVolume volume = ramp();
  const TransferFunction function{
      {{0.0, {0, 0, 0}}, {1.0, {1, 0, 0}}}, {{0.0, 1.0}}, 1.0};  // opaque: the first face
  Camera camera;
  camera.position = {0.5, 0.5, 4.0};
  camera.focalPoint = {0.5, 0.5, 0.0};
  camera.parallelProjection = true;
  camera.parallelScale = 1.0;  // the cube fills the middle half
  const Image flat = renderExactly(volume, function, camera, 8, 8);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) {
      const bool inside = x >= 2 && x < 6 && y >= 2 && y < 6;
      CHECK(flat.rgba[static_cast<std::size_t>(8 * y + x)].r == Approx(inside ? 1.0 : 0.0).margin(0.02));
    }
  }
  // From the side, z is up: the scalar rises with the rows, the lowest of which comes first.
  camera.position = {-4.0, 0.5, 0.5};
  camera.focalPoint = {0.5, 0.5, 0.5};
  camera.viewUp = {0.0, 0.0, 1.0};
  camera.parallelProjection = false;
  camera.viewAngle = 10.0;
  const Image side = renderExactly(volume, function, camera, 8, 8);
  CHECK(side.rgba[8 * 1 + 4].r < 0.3F);
  CHECK(side.rgba[8 * 6 + 4].r > 0.7F);
}
