// Fingerprints: equal for equal arguments; if one differs, it is named.
#include <functional>
#include <string>
#include <vector>

#include "tests/Catch.h"
#include "vdi/core/Camera.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/core/TransferFunction.h"
#include "vdi/pipeline/Fingerprint.h"

using namespace vdi;

namespace {

struct Parameters {
  Camera camera;
  TransferFunction function{{{0.0, {1.0, 0.5, 1.0}}}, {{0.0, 1.0}}, 1.0};
  GenerateSettings settings;
};

std::vector<std::string> different(const Parameters& a, const Parameters& b) {
  const auto ofA = detail::fingerprintsOf(a.camera, a.function, a.settings);
  const auto ofB = detail::fingerprintsOf(b.camera, b.function, b.settings);
  REQUIRE(ofA.size() == ofB.size());
  std::vector<std::string> names;
  for (std::size_t i = 0; i < ofA.size(); ++i) {
    if (ofA[i].value != ofB[i].value) names.emplace_back(ofA[i].what);
  }
  return names;
}

}  // namespace

TEST_CASE("fingerprints name the parameter that differs") {
  using Change = std::function<void(Parameters&)>;
  const std::vector<std::pair<std::string, Change>> changes{
      {"camera position", [](Parameters& p) { p.camera.position.z += 1e-9; }},
      {"camera focal point", [](Parameters& p) { p.camera.focalPoint.x = 3.0; }},
      {"camera view-up", [](Parameters& p) { p.camera.viewUp = glm::dvec3(1.0, 0.0, 0.0); }},
      {"camera view angle", [](Parameters& p) { p.camera.viewAngle += 1.0; }},
      {"camera parallel projection", [](Parameters& p) { p.camera.parallelProjection = true; }},
      {"camera parallel scale", [](Parameters& p) { p.camera.parallelScale += 1.0; }},
      {"transfer function's colours", [](Parameters& p) { p.function.colors[0].color.g = 0.25; }},
      {"transfer function's opacities",
       [](Parameters& p) {
         p.function.opacities.push_back({0.5, 1.0});
       }},
      {"scalar opacity unit distance", [](Parameters& p) { p.function.unitDistance = 2.0; }},
      {"width", [](Parameters& p) { ++p.settings.width; }},
      {"height", [](Parameters& p) { ++p.settings.height; }},
      {"margin", [](Parameters& p) { p.settings.margin = 0.5; }},
      {"supersegments", [](Parameters& p) { ++p.settings.supersegments; }},
      {"budget", [](Parameters& p) { p.settings.budget = Budget::Total; }},
      {"fill", [](Parameters& p) { p.settings.fill = 0.5; }},
      {"sampling rate", [](Parameters& p) { p.settings.samplesPerVoxel = 2.0; }},
      {"interpolation", [](Parameters& p) { p.settings.interpolation = Interpolation::Nearest; }},
      {"algorithm", [](Parameters& p) { p.settings.algorithm = Algorithm::Bisection; }},
      {"precision", [](Parameters& p) { p.settings.precision = Precision::Full; }},
      {"termination opacity", [](Parameters& p) { p.settings.terminationOpacity = 0.5; }},
      {"shade", [](Parameters& p) { p.settings.shading.on = true; }},
      {"ambient", [](Parameters& p) { p.settings.shading.ambient = 0.5; }},
      {"diffuse", [](Parameters& p) { p.settings.shading.diffuse = 0.5; }},
      {"lights", [](Parameters& p) { p.settings.shading.lights[2].color.g = 0.5; }},
      {"cropping box",
       [](Parameters& p) {
         p.settings.region.box = Box{glm::dvec3(0.0), glm::dvec3(1.0)};
       }},
      {"clipping planes", [](Parameters& p) { p.settings.region.planes.push_back({}); }},
      {"blend mode", [](Parameters& p) { p.settings.blending.mode = BlendMode::Minimum; }},
      {"isovalues", [](Parameters& p) { p.settings.blending.isovalues.push_back(0.5); }}};
  const Parameters given;
  CHECK(different(given, Parameters(given)).empty());
  CHECK(changes.size() == detail::fingerprintsOf(given.camera, given.function, given.settings).size());
  for (const auto& [name, change] : changes) {
    Parameters changed = given;
    change(changed);
    CHECK(different(given, changed) == std::vector<std::string>{name});
  }
}

TEST_CASE("fingerprints: -0 is 0") {
  Parameters negative;
  const Parameters positive = negative;
  negative.camera.focalPoint = glm::dvec3(-0.0);
  negative.camera.viewUp.x = -0.0;
  negative.function.colors[0].x = -0.0;
  negative.function.opacities[0].x = -0.0;
  negative.settings.margin = -0.0;
  CHECK(different(positive, negative).empty());
}
