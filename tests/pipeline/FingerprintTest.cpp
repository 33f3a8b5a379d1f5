// What ranks compare: equal for equal parameters, different as soon as one differs.
#include <catch2/catch.hpp>
#include <functional>
#include <set>

#include "vdi/core/Camera.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/core/TransferFunction.h"
#include "vdi/pipeline/Fingerprint.h"

using namespace vdi;
using detail::fingerprintOf;

namespace {

/// How many different fingerprints a value and its changed copies have.
template <typename Value>
std::size_t differentOf(const Value& value, const std::vector<std::function<void(Value&)>>& changes) {
  std::set<std::uint64_t> prints{fingerprintOf(value), fingerprintOf(Value(value))};
  for (const auto& change : changes) {
    Value changed = value;
    change(changed);
    prints.insert(fingerprintOf(changed));
  }
  return prints.size();
}

}  // namespace

TEST_CASE("fingerprints differ with every field, and with nothing else") {
  CHECK(differentOf<Camera>({},
                            {[](Camera& c) { c.position.z += 1e-9; }, [](Camera& c) { c.focalPoint.x = 3.0; },
                             [](Camera& c) {
                               c.viewUp = {1.0, 0.0, 0.0};
                             },
                             [](Camera& c) { c.viewAngle += 1.0; },
                             [](Camera& c) { c.parallelProjection = !c.parallelProjection; },
                             [](Camera& c) { c.parallelScale += 1.0; }}) == 7);
  CHECK(differentOf<GenerateSettings>(
            {},
            {[](GenerateSettings& s) { ++s.width; }, [](GenerateSettings& s) { ++s.height; },
             [](GenerateSettings& s) { ++s.supersegments; },
             [](GenerateSettings& s) { s.budget = Budget::Total; }, [](GenerateSettings& s) { s.fill = 0.5; },
             [](GenerateSettings& s) { s.samplesPerVoxel = 2.0; },
             [](GenerateSettings& s) { s.algorithm = Algorithm::Bisection; },
             [](GenerateSettings& s) { s.precision = Precision::Full; },
             [](GenerateSettings& s) { s.terminationOpacity = 0.5; }}) == 10);
  // Nodes of colours have the numbers of two nodes of opacities.
  TransferFunction function;
  function.colors = {{0.0, {1.0, 0.5, 1.0}}};
  CHECK(differentOf<TransferFunction>(function, {[](TransferFunction& f) { f.colors[0].color.g = 0.25; },
                                                 [](TransferFunction& f) { f.unitDistance = 2.0; },
                                                 [](TransferFunction& f) {
                                                   f.colors.clear();
                                                   f.opacities = {{0.0, 1.0}, {0.5, 1.0}};
                                                 }}) == 4);
}
