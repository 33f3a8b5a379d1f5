// Documents cut, spliced and altered at random: each is refused with its place, or gives a run that can be
// made. VDI_FUZZ_SECONDS sets the duration.
#include <algorithm>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "tests/Catch.h"
#include "tests/FuzzTime.h"
#include "vdi/config/ColorMap.h"
#include "vdi/config/Run.h"
#include "vdi/core/Error.h"
#include "vdi/core/SettingsTable.h"

using namespace vdi;

namespace {

const std::vector<std::string> runs{
    R"({"field": "V", "every": 10})",
    R"({"field": "u", "association": "points", "component": 2, "every": 4,
 "orbit": {"azimuth": 30, "elevation": 20, "view_up": [0, 0, 1], "zoom": 2, "turn": 10, "view_angle": 40},
 "colors": {"preset": "haze", "range": [0, 2], "opacities": [[0, 0], [2, 0.5]], "unit_distance": 3},
 "resolution": [320, 200], "supersegments": 12, "margin": 0.5, "sampling_rate": 2, "shade": true,
 "output": {"vdi": "a/{timestep}.vdi", "png": "b_{timestep:03d}.png"},
 "stream": {"host": "::1", "port": 8080, "certificate": "c", "key": "k", "megabits": 100}})",
    R"({"field": "V", "camera": {"position": [0, 0, 1], "focal_point": [0, 0, 0], "view_up": [0, 1, 0],
 "parallel_scale": 2}, "colors": "bands", "output": "{timestep:06d}.png", "stream": true})",
    R"({"field": "V", "every_time": 0.5, "every_seconds": 60, "max_share": 0.05, "existing": "continue",
 "when": {"change": "V", "component": 1, "above": 0.1, "below": 3},
 "cameras": [{"name": "front", "orbit": {"azimuth": 5}},
  {"name": "b", "camera": {"position": [0, 0, 1], "focal_point": [0, 0, 0]}}],
 "stream": {"steer": true, "steering_log": "a"}, "output": "{timestep}.vdi"})",
    R"({"field": "V", "orbit": {"count": 3, "elevations": [-10, 20]}, "output": {"cinema": "a.cdb",
 "vdi": "{camera}/{timestep}.vdi"}})",
    R"({"fields": ["V", {"field": "u", "name": "b", "component": 1, "missing": [0, -1], "interpolation": "nearest",
 "colors": {"preset": "haze", "range": [0, 2]}}], "association": "cells", "output": "{field}/{timestep}.vdi"})"};
const std::vector<std::string> presets{
    R"([{"Name": "a", "ColorSpace": "Diverging", "RGBPoints": [0, 0.1, 0.2, 0.3, 1, 0.9, 0.8, 0.2, 3, 1, 1, 1]}])",
    R"({"ColorSpace": "Lab", "RGBPoints": [-1, 0, 0, 0, 1, 1, 1, 1], "Points": [0, 0, 0.5, 0, 2, 0.5, 0.5, 0]})",
    R"({"ColorSpace": "HSV", "RGBPoints": [-1, 0, 0, 0, 1, 1, 0.5, 1, 1, 0, 0, 1]})",
    R"({"ColorSpace": "Step", "RGBPoints": [-1, 0, 0, 0, 1, 1, 1, 1]})"};
const std::vector<std::string> pieces{"0",         "-1",      "1e308",      "-1e308", "5e-324",
                                      "1e-300",    "180",     "{",          "}",      "[",
                                      "]",         ",",       ":",          "\"",     "null",
                                      "true",      "\\u0000", "\n",         "NaN",    "99999999999999999999",
                                      "[0, 0, 0]", "\"V\"",   "{timestep}", "\xff"};

std::string mutated(const std::vector<std::string>& seeds, std::mt19937& random) {
  const auto below = [&](std::size_t count) {
    return std::uniform_int_distribution<std::size_t>(0, count - 1)(random);
  };
  std::string text = seeds[below(seeds.size())];
  for (std::size_t changes = 1 + below(3); changes > 0; --changes) {
    const std::size_t at = below(text.size() + 1);
    const std::size_t length = std::min(text.size() - at, below(12));
    switch (below(4)) {
      case 0:
        text.erase(at, length);
        break;
      case 1:
        text.insert(at, pieces[below(pieces.size())]);
        break;
      case 2: {  // a number or a text becomes another one
        const std::size_t start = text.find_first_of("0123456789", at);
        if (start == std::string::npos) break;
        const std::size_t end = text.find_first_not_of("0123456789.", start);
        text.replace(start, end == std::string::npos ? end : end - start, pieces[below(pieces.size())]);
        break;
      }
      default:
        if (at < text.size()) text[at] = static_cast<char>(below(256));
    }
  }
  return text;
}

/// Returns whether the text is refused.
template <typename Read>
bool isRefused(const std::string& text, Read read) {
  try {
    read(text);
    return false;
  } catch (const Error& error) {
    constexpr std::size_t oneLine = 1000;
    const std::string_view what = error.what();
    INFO(text);
    INFO(what);
    REQUIRE(error.code() == ErrorCode::Format);
    REQUIRE(what.size() < oneLine);
    REQUIRE(what.find("line ") != std::string_view::npos);
    return true;
  }
}

void readAndMake(const std::string& text) {
  const config::Run run = config::parseRun(text, "x.json");
  INFO(text);
  const Box bounds{glm::dvec3(-1.0), glm::dvec3(2.0)};
  REQUIRE_NOTHROW(validate(run.settings));
  REQUIRE_FALSE(run.fields.empty());
  for (const config::RunField& field : run.fields)
    REQUIRE_NOTHROW(validate(field.colors.transferFunction({0.0, 1.0}, 1.0)));
  REQUIRE_FALSE(run.cameras.empty());
  for (const config::RunCamera& camera : run.cameras)
    REQUIRE_NOTHROW(View(run.cameraAt(camera, run.every, 2.0, bounds), 4, 4));
  if (run.vdi) REQUIRE(run.vdi->path(7, run.cameras.back().name, run.fields.back().name).has_filename());
  if (run.when) REQUIRE((run.when->above || run.when->below));
}

void readMap(const std::string& text) {
  const config::ColorMap map = config::rescaled(config::colorMapOf(text, "x.json", ""), {-2.0, 5.0});
  TransferFunction function{map.colors, map.opacities, 1.0};
  if (function.opacities.empty()) function.opacities = {{0.0, 1.0}};
  INFO(text);
  REQUIRE_NOTHROW(validate(function));
}

}  // namespace

TEST_CASE("documents altered at random are refused or can be made") {
  std::mt19937 random(static_cast<std::mt19937::result_type>(6 + test::fuzzSeed()));
  const test::FuzzTime time(0.0);
  constexpr int atLeast = 20000;
  int refused = 0;
  int all = 0;
  while (all < atLeast || !time.isOver()) {
    ++all;
    if (isRefused(mutated(runs, random), readAndMake)) ++refused;
    if (isRefused(mutated(presets, random), readMap)) ++refused;
  }
  CHECK(refused > all / 4);
  CHECK(refused < 2 * all);
}
