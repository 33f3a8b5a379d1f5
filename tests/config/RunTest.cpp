// Fields that vdi.json may have, and mistakes that are refused.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "tests/Catch.h"
#include "tests/TemporaryFolder.h"
#include "vdi/config/Run.h"
#include "vdi/config/Schedule.h"
#include "vdi/core/Error.h"
#include "vdi/core/SettingsTable.h"
#include "vdi/core/UnitDistance.h"

using namespace vdi;
using config::FilePattern;
using config::parseRun;
using config::Run;
using config::Schedule;
using nlohmann::json;

namespace {

void refused(const std::string& text, const std::string& part) {
  INFO(text);
  CHECK_THROWS_WITH(parseRun(text, "vdi.json"), test::ContainsSubstring(part));
}
/// Checks that a document with the required field and this one is refused.
void refusedField(const std::string& field, const std::string& part) {
  refused("{\"field\": \"V\",\n" + field + "}", part);
}

json schema() {
  std::ifstream file(VDI_RUN_SCHEMA);
  return json::parse(file);
}

/// The part of the schema to which this part refers; the part itself if it has no reference.
const json& followed(const json& all, const json& part) {
  if (!part.contains("$ref")) return part;
  return all.at(json::json_pointer(part.at("$ref").get<std::string>().substr(1)));
}

/// The object with "properties" in a part of the schema, below anyOf if need be.
const json* objectIn(const json& part) {
  if (part.contains("properties")) return &part;
  if (!part.contains("anyOf")) return nullptr;
  for (const json& choice : part.at("anyOf")) {
    if (choice.contains("properties")) return &choice;
  }
  return nullptr;
}

}  // namespace

TEST_CASE("V every 10 steps is one line") {
  const Run run = parseRun(R"({"field": "V", "every": 10})", "vdi.json");
  REQUIRE(run.fields.size() == 1);
  CHECK(run.fields[0].array == "V");
  CHECK(run.fields[0].name.empty());
  const Schedule schedule(run);
  CHECK_FALSE(schedule.needsRoot());
  CHECK(schedule.isDue(0, 0.0, 0.0));
  CHECK_FALSE(schedule.isDue(5, 0.0, 0.0));
  CHECK(schedule.isDue(30, 0.0, 0.0));
  CHECK(run.fields[0].component == -1);
  CHECK(run.settings.width == 1280);
  CHECK(run.settings.samplesPerVoxel == automaticRate);
  REQUIRE(run.vdi);
  CHECK(run.vdi->path(10) == "vdi_000010.vdi");
  CHECK_FALSE(run.png);
  CHECK_FALSE(run.stream);
  const Box unit{glm::dvec3(0.0), glm::dvec3(1.0)};
  REQUIRE(run.cameras.size() == 1);
  CHECK(run.cameraAt(run.cameras[0], 0, 0.0, unit) ==
        Camera::framing(unit, {0.0, 0.0, -1.0}, {0.0, 1.0, 0.0}));
}

TEST_CASE("every field of the schema is read, and no other") {
  const json all = schema();
  std::set<std::string> seen;
  const auto compare = [&](const std::string& pointer, const json& object) {
    INFO("the fields of '" << pointer << "'");
    REQUIRE(config::runFields().count(pointer) == 1);
    std::set<std::string> inSchema;
    for (const auto& [name, value] : object.at("properties").items()) inSchema.insert(name);
    const auto& fields = config::runFields().at(pointer);
    CHECK(inSchema == std::set<std::string>(fields.begin(), fields.end()));
    CHECK(object.at("additionalProperties") == false);
    seen.insert(pointer);
  };
  compare("", all);
  for (const auto& [name, part] : all.at("properties").items()) {
    const json& value = followed(all, part);
    if (const json* object = objectIn(value)) compare("/" + name, *object);
    const json* item = value.contains("items") ? objectIn(value.at("items")) : nullptr;
    if (item != nullptr) compare("/" + name + "/*", *item);
  }
  CHECK(seen.size() == config::runFields().size());
}

TEST_CASE("the schema's presets are those that there are, and its defaults those of the code") {
  const json all = schema();
  for (const std::string name : all.at("$defs").at("preset").at("enum"))
    CHECK_NOTHROW(parseRun(R"({"field": "V", "colors": ")" + name + "\"}", "vdi.json"));
  refusedField(R"("colors": "viridis")", "use one of Cool to Warm, three-hues, haze, bands, surface;");
  CHECK(all.at("$defs").at("preset").at("enum").size() == 5);
  json given{{"field", "V"}};
  for (const auto& [name, part] : all.at("properties").items()) {
    const json& value = followed(all, part);
    if (value.contains("default")) given[name] = value.at("default");
  }
  CHECK(given.size() > 7);
  const Run stated = parseRun(given.dump(), "vdi.json");
  const Run implied = parseRun(R"({"field": "V"})", "vdi.json");
  CHECK(stated.settings == implied.settings);
  CHECK(stated.every == implied.every);
  CHECK(stated.existing == implied.existing);
  CHECK(stated.fields[0].component == implied.fields[0].component);
}

TEST_CASE("the schema has the ranges and names of the table of settings") {
  const json all = schema();
  for (const Setting& setting : settingsTable()) {
    INFO(setting.key);
    const json& part = followed(all, all.at("properties").at(setting.key));
    const double standard =
        setting.key == std::string("sampling_rate") ? automaticRate : setting.get(GenerateSettings());
    switch (setting.kind) {
      case Setting::Kind::Flag:
        CHECK(part.at("type") == "boolean");
        CHECK(part.at("default") == (standard != 0.0));
        break;
      case Setting::Kind::Name:
        CHECK(part.at("default") == setting.nameOf(standard));
        CHECK(part.at("enum").size() == static_cast<std::size_t>(setting.high) + 1);
        for (const std::string name : part.at("enum")) CHECK(setting.nameOf(setting.named(name)) == name);
        break;
      default:
        CHECK(part.at("type") == (setting.kind == Setting::Kind::Count ? "integer" : "number"));
        CHECK(part.at("default") == standard);
        CHECK(part.at("maximum") == setting.high);
        const double least = std::isnan(setting.automatic) ? setting.low : setting.automatic;
        CHECK(part.at(setting.excludesLow ? "exclusiveMinimum" : "minimum") == least);
    }
  }
}

TEST_CASE("everything at once") {
  const Run run = parseRun(R"({
    "field": "u", "association": "points", "component": 2, "every": 4,
    "orbit": {"azimuth": 30, "elevation": 20, "view_up": [0, 0, 1], "zoom": 2, "turn": 10, "view_angle": 40},
    "colors": {"preset": "haze", "range": [0, 2], "opacities": [[0, 0], [2, 0.5]], "unit_distance": 3},
    "resolution": [320, 200], "supersegments": 12, "margin": 0.5, "sampling_rate": 2, "shade": true,
    "output": {"vdi": "a/{timestep}.vdi", "png": "b_{timestep:03d}.png", "cinema": "c.cdb", "latest": true},
    "when": {"mean": "p", "association": "cells", "component": 1, "above": -1, "below": 2},
    "max_share": 0.05, "max_device_mib": 512, "max_host_mib": 9000, "existing": "continue", "isolation": {"restart": true, "patience": 20},
    "log": {"json": "run.jsonl", "text": "run.log"},
    "stream": {"host": "::1", "port": 8080, "token_file": "t", "link_file": "l", "certificate": "c", "key": "k",
               "origins": ["https://a.example"], "embed_in": ["https://b.example", "http://c.example"],
               "title": "Run 7", "megabits": 100, "steer": true, "steering_log": "s"}})",
                           "vdi.json");
  CHECK(run.fields[0].cells == std::optional<bool>(false));
  CHECK(run.fields[0].component == 2);
  CHECK(run.settings.width == 320);
  CHECK(run.settings.height == 200);
  CHECK(run.settings.supersegments == 12);
  CHECK(run.settings.margin == 0.5);
  CHECK(run.settings.samplesPerVoxel == 2.0);
  CHECK(run.settings.shading.on);
  CHECK(run.vdi->path(12) == "a/12.vdi");
  CHECK(run.png->path(12) == "b_012.png");
  CHECK(run.latest);
  CHECK(run.log.json == "run.jsonl");
  CHECK(run.log.text == "run.log");
  CHECK(run.stream->port == 8080);
  CHECK(run.stream->origins == std::vector<std::string>{"https://a.example"});
  CHECK(run.stream->embedIn == std::vector<std::string>{"https://b.example", "http://c.example"});
  CHECK(run.stream->title == "Run 7");
  CHECK(run.stream->megabits == 100.0);
  CHECK(run.stream->steer);
  CHECK(run.stream->steeringLog == "s");
  CHECK(run.cinema->folder == "c.cdb");
  CHECK(run.cinema->pictures.path(12) == "c.cdb/000012.png");
  CHECK(run.when->measure == config::RunCondition::Measure::Mean);
  CHECK(run.when->field == "p");
  CHECK(run.when->cells == std::optional<bool>(true));
  CHECK(run.when->component == 1);
  CHECK(run.when->holds(1.9));
  CHECK_FALSE(run.when->holds(-1.0));
  CHECK_FALSE(run.when->holds(2.0));
  CHECK(run.maxShare == 0.05);
  CHECK(run.maxDeviceMiB == 512);
  CHECK(run.maxHostMiB == 9000);
  CHECK(run.existing == config::Existing::Continue);
  CHECK(run.isolation->restart);
  CHECK(run.isolation->patience == 20.0);
  CHECK_FALSE(parseRun(R"({"field": "V"})", "vdi.json").isolation);
  CHECK(parseRun(R"({"field": "V", "isolation": "process"})", "vdi.json").isolation->patience == 300.0);
  const TransferFunction function = run.fields[0].colors.transferFunction({5.0, 6.0}, 7.0);
  CHECK(function.colors.back().x == 2.0);
  CHECK(function.opacities == std::vector<OpacityNode>{{0.0, 0.0}, {2.0, 0.5}});
  CHECK(function.unitDistance == 3.0);
  const Box unit{glm::dvec3(0.0), glm::dvec3(1.0)};
  CHECK(run.cameraAt(run.cameras[0], 8, 0.0, unit) ==
        config::orbitCamera(unit, {.azimuth = 50.0, .elevation = 20.0, .up = {0.0, 0.0, 1.0}, .zoom = 2.0},
                            40.0));
}

TEST_CASE("the default colours are ParaView's, over the first frame's range") {
  const config::RunColors colors = parseRun(R"({"field": "V"})", "vdi.json").fields[0].colors;
  const TransferFunction function = colors.transferFunction({2.0, 4.0}, 0.25);
  CHECK(function.opacities == std::vector<OpacityNode>{{2.0, 0.0}, {4.0, 1.0}});
  CHECK(function.colors.front() == ColorNode{2.0, {0.231373, 0.298039, 0.752941}});
  CHECK(function.colors.back().x == 4.0);
  CHECK(function.unitDistance == 0.25);
  CHECK_NOTHROW(validate(function));
  CHECK_NOTHROW(validate(colors.transferFunction({3.0, 3.0}, 1.0)));
  CHECK_NOTHROW(validate(colors.transferFunction(ScalarRange(), 1.0)));
}

TEST_CASE("mistakes are told with their place") {
  refused("[]", "must be an object (vdi.json, line 1)");
  refused("{\"every\": 10}", "the field 'field' is missing");
  refused(R"({"field": ""})", "/field: must be an array's name");
  refusedField(R"("evry": 10)", "/evry: no such field; the fields are $schema, field");
  refusedField(R"("every": 0)", "/every: must be a whole number from 1 to 2147483647 (vdi.json, line 2)");
  refusedField(R"("every": "10")", "/every: must be a whole number");
  refusedField(R"("every": 1e400)", "line 2");
  refusedField(R"("every_time": 0)", "/every_time: must be > 0 (vdi.json, line 2)");
  refusedField(R"("every_seconds": "60")", "/every_seconds: must be a number");
  refusedField(R"("when": "max")", "/when: must be an object");
  refusedField(R"("when": {"max": "V"})", "/when: must have a bound, 'above' or 'below'");
  refusedField(R"("when": {"above": 1})", "/when: must have 'max', 'min', 'mean' or 'change'");
  refusedField(R"("when": {"max": "V", "min": "V", "above": 1})", "/when/min: a condition has one of");
  refusedField(R"("when": {"max": 1, "above": 1})", "/when/max: must be a string");
  refusedField(R"("when": {"max": "", "above": 1})", "/when/max: must be an array's name");
  refusedField(R"("when": {"max": "V", "above": "high"})", "/when/above: must be a number");
  refusedField(R"("when": {"max": "V", "above": 2, "below": 2})", "/when: never holds");
  refusedField(R"("when": {"max": "V", "above": 1, "component": 16})", "/when/component");
  refusedField(R"("when": {"max": "V", "above": 1, "component": "together"})", "/when/component");
  refusedField(R"("when": {"max": "V", "above": 1, "association": "faces"})", "/when/association");
  refusedField(R"("max_share": 1.5)", "/max_share: is a share, 1 at most");
  refusedField(R"("max_share": 0)", "/max_share: must be > 0");
  refusedField(R"("max_device_mib": 0)", "/max_device_mib");
  refusedField(R"("max_device_mib": 31)", "/max_device_mib");
  refusedField(R"("missing": -9999)", "/missing");
  refusedField(R"("missing": [1, "x"])", "/missing/1");
  refusedField(R"("max_host_mib": 0)", "/max_host_mib");
  refusedField(R"("existing": "append")", "/existing: must be 'refuse', 'overwrite' or 'continue'");
  refusedField(R"("existing": true)", "/existing: must be a string");
  refusedField(R"("isolation": "thread")", "/isolation: must be 'process', or an object");
  refusedField(R"("isolation": {"restarts": true})", "/isolation/restarts: no such field");
  refusedField(R"("isolation": {"restart": 1})", "/isolation/restart: must be");
  refusedField(R"("isolation": {"patience": -1})", "/isolation/patience: must be from 0");
  refusedField(R"("association": "nodes")", "/association: must be 'cells' or 'points'");
  refusedField(R"("component": -1)", "/component");
  refusedField(R"("camera": {"position": [0, 0, 1]})", "/camera: the field 'focal_point' is missing");
  refusedField(R"("camera": {"position": [0, 0, 1], "focal_point": [0, 0, 1]})", "/camera: ");
  refusedField(R"("camera": {"position": [0, 0, 1], "focal_point": [0, 0, 0], "view_angle": 180})",
               "/camera/view_angle");
  refusedField(R"("camera": {"position": [0, 0, 1], "focal_point": [0, 0, 0]}, "orbit": {})",
               "/orbit: can't be combined with 'camera'");
  refusedField(R"("orbit": {"view_up": [0, 0, 0]})", "/orbit/view_up: must not be zero");
  refusedField(R"("orbit": {"zoom": 0})", "/orbit/zoom: must be from 0.001 to 1000, but is 0");
  refusedField(R"("colors": {"range": [1, 1]})", "/colors/range: the first");
  refusedField(R"("colors": {"range": [-1e308, 1e308]})", "/colors/range: is too wide");
  refusedField(R"("colors": {"range": [NaN, 1]})", "not valid JSON");
  refusedField(R"("colors": {"preset": "haze", "file": "a"})", "/colors/file: can't be combined");
  refusedField(R"("colors": {"name": "a"})", "/colors/name");
  refusedField(R"("colors": {"opacities": []})", "/colors/opacities: must have a node");
  refusedField(R"("colors": {"opacities": [[1, 0], [0, 1]]})", "/colors/opacities/1: nodes must ascend");
  refusedField(R"("colors": {"opacities": [[1, 2]]})", "/colors/opacities/0: an opacity");
  refusedField(R"("resolution": [0, 5])", "/resolution/0: must be a whole number from 1 to 32768");
  refusedField(R"("sampling_rate": 65)", "/sampling_rate: sampling rate must lie in [1/64, 64], or be 0");
  refusedField(R"("supersegments": 2.5)", "/supersegments: supersegments must be a whole number");
  refusedField(R"("algorithm": "best")", "/algorithm: no algorithm 'best'; use merge or bisection");
  refusedField(R"("fill": 0.5)", "a fill of 0.5 needs the total budget");
  refusedField(R"("precision": 1)", "/precision: ");
  refusedField(R"("output": "a.vdi")", "/output: must contain {timestep}");
  refusedField(R"("output": "{timestep}.jpg")", "/output: must end in .vdi, .png or .cdb");
  refusedField(R"("output": {})", "/output: must name a file");
  refusedField(R"("output": {"png": "{timestep:6d}.png"})", "/output/png: the step's number is");
  refusedField(R"("output": {"png": "{timestep}{timestep}.png"})", "/output/png: only");
  refusedField(R"("output": {"png": "{timestep:099d}.png"})", "/output/png: the step's number is");
  refusedField(R"("output": {"vdi": "{timestep}.vdi", "latest": 1})",
               "/output/latest: must be true or false");
  refusedField(R"("log": "run.txt")", "/log: must end in .jsonl, for lines of JSON, or in .log, for text");
  refusedField(R"("log": {})", "/log: must name a file");
  refusedField(R"("log": {"json": "logs/"})", "/log/json: must be a file's name");
  refusedField(R"("log": {"json": "a", "text": "a"})", "/log: 'json' and 'text' must be two files");
  refusedField(R"("stream": {"port": 65536})", "/stream/port");
  refusedField(R"("stream": {"certificate": "c"})", "/stream: 'certificate' and 'key'");
  refusedField(R"("stream": {"steer": 1})", "/stream/steer: must be true or false");
  refusedField(R"("stream": {"steering_log": "s"})", "/stream/steering_log: needs \"steer\": true");
}

TEST_CASE("mistakes of several cameras are told with their place") {
  const std::string fixed = R"("camera": {"position": [0, 0, 1], "focal_point": [0, 0, 0]})";
  refusedField(R"("cameras": {})", "/cameras: must be an array");
  refusedField(R"("cameras": [])", "/cameras: must have a camera");
  refusedField(R"("cameras": [{}])", "/cameras/0: the field 'name' is missing");
  refusedField(R"("cameras": [{"name": "a"}])", "/cameras/0: must have a 'camera' or an 'orbit'");
  refusedField(R"("cameras": [{"name": "a/b", "orbit": {}}])", "/cameras/0/name: a camera's name has");
  refusedField(R"("cameras": [{"name": ".a", "orbit": {}}])", "/cameras/0/name: a camera's name has");
  refusedField(R"("cameras": [{"name": "a", "orbit": {}}, {"name": "a", "orbit": {}}])",
               "/cameras/1/name: another camera has this name");
  refusedField(R"("cameras": [{"name": "a", "orbit": {}, )" + fixed + "}]",
               "/cameras/0/orbit: can't be combined");
  refusedField(R"("cameras": [{"name": "a", "orbit": {"count": 4}}])",
               "/cameras/0/orbit/count: a camera of 'cameras' is one viewpoint");
  refusedField(R"("cameras": [{"name": "a", "orbit": {}}], )" + fixed,
               "/cameras: can't be combined with 'camera'");
  refusedField(R"("orbit": {}, "cameras": [{"name": "a", "orbit": {}}])",
               "/cameras: can't be combined with 'orbit'");
  refusedField(R"("orbit": {"count": 0})", "/orbit/count: must be a whole number from 1 to 1000");
  refusedField(R"("orbit": {"count": 600, "elevations": [0, 10]})", "/orbit: 1200 viewpoints; at most 1000");
  refusedField(R"("orbit": {"elevations": []})", "/orbit/elevations: must have an elevation");
  refusedField(R"("orbit": {"elevations": [0, 0]})", "/orbit/elevations/1: occurs twice");
  refusedField(R"("orbit": {"elevations": [91]})", "/orbit/elevations/0: must be from -90 to 90");
  refusedField(R"("orbit": {"elevations": [1], "elevation": 1})", "/orbit/elevations: can't be combined");
  refusedField(R"("orbit": {"count": 2, "turn": 5})", "/orbit/turn: can't be combined");
  refusedField(R"("orbit": {"turn": 5}, "every_seconds": 5)", "an orbit's 'turn' goes with only one of");
  refusedField(R"("output": "{timestep}_{camera}.vdi")", "/output: {camera} needs several viewpoints");
  refusedField(R"("orbit": {"count": 2}, "output": "{timestep}_{camera}{camera}.vdi")", "/output: only");
  refusedField(R"("orbit": {"count": 2}, "stream": true)", "several viewpoints need an 'output'");
  refusedField(R"("orbit": {}, "output": {"cinema": "a.cdb", "latest": true})", "/output/latest: needs");
  refusedField(R"("output": "a.cdb")", "/output: a Cinema database needs an 'orbit'");
  refusedField(R"("orbit": {}, "output": {"cinema": "a"})", "/output/cinema: must be a folder's name");
  refusedField(R"("orbit": {}, "output": {"cinema": "{timestep}.cdb"})",
               "/output/cinema: must be a folder's");
}

TEST_CASE("each camera has files of its own") {
  const Run run = parseRun(R"({"field": "V", "orbit": {"azimuth": 10, "count": 4, "elevations": [0, 30, 60]},
                               "output": {"vdi": "a.b/{timestep}", "png": "{camera}/{timestep:03d}.png",
                                          "cinema": "c.cdb"}})",
                           "vdi.json");
  REQUIRE(run.cameras.size() == 12);
  CHECK(run.cameras[5].name == "05");
  CHECK(run.vdi->path(7, "05") == "a.b/7_05");
  CHECK(run.png->path(7, "05") == "05/007.png");
  CHECK(run.cinema->pictures.path(7, "05") == "c.cdb/000007/05.png");
  const config::Orbit place = run.orbitAt(*run.cameras[5].orbit, 7, 0.0);
  CHECK(place.azimuth == Approx(100.0));
  CHECK(place.elevation == 30.0);
  const Run named = parseRun(R"({"field": "V", "cameras": [{"name": "front", "orbit": {}},
      {"name": "top", "orbit": {"elevation": 90, "view_up": [0, 0, 1]}}]})",
                             "vdi.json");
  CHECK(named.vdi->path(7, "top") == "vdi_000007_top.vdi");
  const Box unit{glm::dvec3(0.0), glm::dvec3(1.0)};
  CHECK(named.cameraAt(named.cameras[1], 0, 0.0, unit).position.z > 1.0);
  const Run turning = parseRun(R"({"field": "V", "every_time": 0.5, "orbit": {"turn": 10}})", "vdi.json");
  CHECK(turning.orbitAt(*turning.cameras[0].orbit, 77, 1.5).azimuth == Approx(30.0));
}

TEST_CASE("each field has entries and files of its own") {
  const Run run = parseRun(R"({"association": "points", "component": 1, "missing": [-9999], "shade": true,
      "interpolation": "nearest", "colors": {"preset": "haze", "range": [0, 1]}, "when": {"max": "u", "above": 0},
      "fields": ["V", {"field": "u", "name": "speed", "association": "cells", "component": "magnitude", "missing": [],
                       "colors": "bands", "interpolation": "linear"}, {"field": "u", "component": 0}],
      "orbit": {"count": 2}, "output": {"vdi": "{field}/{timestep:03d}.vdi", "png": "a_{timestep}.png",
                                        "cinema": "c.cdb"}})",
                           "vdi.json");
  REQUIRE(run.fields.size() == 3);
  CHECK(run.fields[0].array == "V");
  CHECK(run.fields[0].name == "V");
  CHECK(run.fields[0].cells == std::optional<bool>(false));
  CHECK(run.fields[0].component == 1);
  CHECK(run.fields[0].missing == std::vector<double>{-9999.0});
  CHECK(run.fields[0].colors.preset == "haze");
  CHECK(run.fields[1].array == "u");
  CHECK(run.fields[1].name == "speed");
  CHECK(run.fields[1].cells == std::optional<bool>(true));
  CHECK(run.fields[1].component == -1);
  CHECK(run.fields[1].missing.empty());
  CHECK(run.when->missing.empty());  // as u is shown
  CHECK(run.fields[1].colors.preset == "bands");
  CHECK_FALSE(run.fields[1].colors.range);
  CHECK(run.fields[2].name == "u");
  CHECK(run.fields[2].component == 0);
  CHECK(run.fields[2].colors.range->max == 1.0);
  CHECK(run.settingsOf(run.fields[0]).interpolation == Interpolation::Nearest);
  CHECK(run.settingsOf(run.fields[1]).interpolation == Interpolation::Linear);
  CHECK(run.settingsOf(run.fields[1]).shading.on);
  CHECK(run.vdi->path(7, "1", "speed") == "speed/007_1.vdi");
  CHECK(run.png->path(7, "1", "speed") == "a_7_speed_1.png");
  CHECK(run.cinema->pictures.path(7, "1", "speed") == "c.cdb/000007/speed/1.png");
  CHECK(parseRun(R"({"fields": ["V"], "missing": [3], "when": {"max": "p", "above": 0}})", "vdi.json")
            .when->missing == std::vector<double>{3.0});
  CHECK(parseRun(R"({"fields": ["V"]})", "vdi.json").vdi->path(7, "", "V") == "vdi_000007_V.vdi");

  refused(R"({"fields": []})", "/fields: must have a field");
  refused(R"({"fields": ["V", "p", "V"]})",
          "/fields/2: another field has the name 'V'; a 'name' tells them apart");
  refused(R"({"fields": ["V", {"field": "p", "name": "V"}]})", "/fields/1: another field has the name 'V'");
  refused(R"({"fields": ["V/m"]})", "/fields/0: files can't have this array's name; add a 'name' of 1 to 64");
  refused(R"({"fields": [{"field": "V/m", "name": "../a"}]})", "/fields/0/name: a field's name has 1 to 64");
  refused(R"({"fields": [{"name": "a"}]})", "/fields/0: the field 'field' is missing");
  refused(R"({"fields": [{"field": "V", "shade": true}]})",
          "/fields/0/shade: no such field; the fields are field");
  refused(R"({"fields": [{"field": "V", "interpolation": "cubic"}]})",
          "/fields/0/interpolation: no interpolation");
  refused(R"({"fields": [3]})", "/fields/0: must be an object");
  refusedField(R"("fields": ["p"])", "/field: can't be combined with 'fields'");
  refusedField(R"("output": "{timestep}_{field}.vdi")", "/output: {field} needs 'fields'");
  refused(R"({"fields": ["V", "p"], "stream": true})", "several fields need an 'output'");
  const std::string alike = R"({"fields": ["a", "a_b"], "cameras": [{"name": "c", "orbit": {}},
                               {"name": "b_c", "orbit": {}}], "output": )";
  refused(alike + R"("{timestep}.vdi"})",
          "/output: field 'a_b' from camera 'c' has the same file as another");
  refused(alike + R"({"vdi": "{field}/{timestep}.vdi", "latest": true}})", "/output/latest: field 'a_b'");
  CHECK_NOTHROW(parseRun(alike + R"("{field}/{timestep}.vdi"})", "vdi.json"));
}

TEST_CASE("times of the simulation are met after a restart as before it") {
  const Run run = parseRun(R"({"field": "V", "every_time": 0.1})", "vdi.json");
  const auto dueFrom = [&](int first, int last) {
    Schedule schedule(run);
    std::vector<int> due;
    double time = 0.0;
    for (int step = 0; step < last; ++step, time += 0.025) {  // rounding adds up
      if (step < first || !schedule.isDue(step, time, 0.0)) continue;
      schedule.begin(time, 0.0);
      due.push_back(step);
    }
    return due;
  };
  CHECK(dueFrom(0, 18) == std::vector<int>{0, 4, 8, 12, 16});
  CHECK(dueFrom(6, 18) == std::vector<int>{6, 8, 12, 16});  // the first step has a frame
  Schedule schedule(run);
  CHECK(schedule.needsRoot());
  CHECK_FALSE(schedule.isDue(0, std::numeric_limits<double>::quiet_NaN(), 0.0));
  schedule.begin(0.5, 0.0);
  CHECK(schedule.isDue(1, 0.25, 0.0));  // back to a checkpoint
}

TEST_CASE("seconds count from the last frame, and any trigger will do") {
  Schedule schedule(parseRun(R"({"field": "V", "every": 10, "every_seconds": 60})", "vdi.json"));
  CHECK(schedule.isDue(3, 0.0, 5.0));
  schedule.begin(0.0, 5.0);
  CHECK_FALSE(schedule.isDue(4, 0.0, 64.0));
  CHECK(schedule.isDue(10, 0.0, 20.0));
  schedule.begin(0.0, 20.0);  // the step triggered this frame
  CHECK(schedule.isDue(11, 0.0, 65.0));
  schedule.setPeriod(7);
  CHECK_FALSE(schedule.isDue(11, 0.0, 1e6));
  CHECK(schedule.isDue(14, 0.0, 0.0));
  CHECK_FALSE(schedule.needsRoot());
}

TEST_CASE("frames take their share of the time at most") {
  config::WallTimeShare share(0.1);
  double spent = 0.0;
  int made = 0;
  double now = 0.0;
  for (int step = 0; step < 1000; ++step) {
    now += 1.0;
    if (!share.hasRoom(now)) continue;
    const double cost = 3.0;
    now += cost;
    spent += cost;
    share.spend(cost);
    if (++made > 1) CHECK(spent <= 0.1 * now);
  }
  CHECK(spent > 0.09 * now);
  CHECK(config::WallTimeShare(std::nullopt).hasRoom(0.0));
}

TEST_CASE("a frame that could exceed the bound of memory is left out") {
  constexpr std::uint64_t mib = std::uint64_t{1} << 20U;
  config::HostMemoryBound bound(100);
  CHECK(bound.hasRoom(bound.needed({100 * mib, 300 * mib})));  // the peak of another time doesn't count
  CHECK(!bound.hasRoom(bound.needed({100 * mib + 1, 0})));
  // A frame uses 50 MiB, and 20 of these stay.
  bound.spend({40 * mib, 50 * mib}, {60 * mib, 90 * mib});
  CHECK(bound.needed({60 * mib, 90 * mib}) == 90 * mib);
  CHECK(bound.needed({71 * mib, 90 * mib}) == 101 * mib);  // the simulation has grown by 11
  // The most expensive frame counts. Without a new peak, only the memory that stays is known.
  bound.spend({60 * mib, 90 * mib}, {65 * mib, 90 * mib});
  CHECK(bound.needed({65 * mib, 90 * mib}) == 90 * mib);
  bound.free({65 * mib, 90 * mib}, {41 * mib, 90 * mib});
  CHECK(bound.needed({41 * mib, 90 * mib}) == 90 * mib);
  CHECK(bound.needed({10 * mib, 90 * mib}) == 59 * mib);
  CHECK(config::HostMemoryBound(std::nullopt).hasRoom(std::uint64_t{1} << 60U));
}

TEST_CASE("what is in the way of a run is named") {
  const test::TemporaryFolder temporary;
  const std::filesystem::path& folder = temporary.path();
  std::filesystem::create_directories(folder / "a_7" / "b");
  const auto touch = [&](const char* name) { std::ofstream(folder / name) << "x"; };
  const auto at = [&](const std::string& pattern) { return FilePattern((folder / pattern).string()); };
  for (const char* name : {"v_000020.vdi", "v_3.vdi", "v_000100.vdi", "v_000010.vdi.bak", "w_12_top.vdi",
                           "v_0000x0.vdi", "a_7/b/c.vdi"})
    touch(name);
  CHECK(at("v_{timestep:06d}.vdi").firstExisting() == folder / "v_000020.vdi");
  CHECK(at("v_{timestep}.vdi").firstExisting() == folder / "v_3.vdi");
  CHECK(at("w_{timestep}.vdi").firstExisting("top") == folder / "w_12_top.vdi");
  CHECK_FALSE(at("w_{timestep}.vdi").firstExisting());
  CHECK(at("a_{timestep}/b/c.vdi").firstExisting() == folder / "a_7" / "b" / "c.vdi");
  CHECK_FALSE(at("a_{timestep}/b/d.vdi").firstExisting());
  CHECK_FALSE(at("none/v_{timestep}.vdi").firstExisting());

  const std::string start =
      R"({"field": "V", "output": ")" + (folder / "v_{timestep:06d}.vdi").string() + "\"";
  const Run refusing = parseRun(start + "}", "vdi.json");
  CHECK_THROWS_WITH(config::requireNothingInTheWay(refusing),
                    test::ContainsSubstring("v_000020.vdi") && test::ContainsSubstring("\"overwrite\""));
  CHECK_NOTHROW(config::requireNothingInTheWay(parseRun(start + R"(, "existing": "continue"})", "vdi.json")));
  const std::string log =
      R"({"field": "V", "stream": true, "log": ")" + (folder / "run.jsonl").string() + "\"}";
  CHECK_NOTHROW(config::requireNothingInTheWay(parseRun(log, "vdi.json")));
  touch("run.jsonl");
  CHECK_THROWS_WITH(config::requireNothingInTheWay(parseRun(log, "vdi.json")),
                    test::ContainsSubstring("run.jsonl"));
}

TEST_CASE("text is told from a file's name") {
  CHECK(config::readRun(" {\"field\": \"V\"}").name == "the JSON text");
  CHECK_THROWS_WITH(config::readRun("none.json"), test::ContainsSubstring("none.json"));
}

TEST_CASE("the unit distance is ParaView's") {
  // For a cube of 10³ voxels it is a voxel's diagonal.
  CHECK(unitDistanceOf({glm::dvec3(0.0), glm::dvec3(2.0)}, 0.008) == Approx(std::sqrt(3.0) * 0.2));
  CHECK(unitDistanceOf(Box(), 1.0) == 1.0);
}
