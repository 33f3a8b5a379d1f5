// What vdi.json can say, and what is refused.
#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "tests/Catch.h"
#include "vdi/config/Run.h"
#include "vdi/core/Error.h"
#include "vdi/core/UnitDistance.h"

using namespace vdi;
using config::FilePattern;
using config::parseRun;
using config::Run;
using nlohmann::json;

namespace {

void refused(const std::string& text, const std::string& part) {
  INFO(text);
  CHECK_THROWS_WITH(parseRun(text, "vdi.json"), test::ContainsSubstring(part));
}
/// With that field beside the one that is needed.
void refusedField(const std::string& field, const std::string& part) {
  refused("{\"field\": \"V\",\n" + field + "}", part);
}

json schema() {
  std::ifstream file(VDI_RUN_SCHEMA);
  return json::parse(file);
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
  CHECK(run.field == "V");
  CHECK(run.wants(0));
  CHECK_FALSE(run.wants(5));
  CHECK(run.wants(30));
  CHECK(run.component == -1);
  CHECK(run.settings.width == 1280);
  CHECK(run.settings.samplesPerVoxel == automaticRate);
  REQUIRE(run.vdi);
  CHECK(run.vdi->path(10) == "vdi_000010.vdi");
  CHECK_FALSE(run.png);
  CHECK_FALSE(run.stream);
  const Box unit{glm::dvec3(0.0), glm::dvec3(1.0)};
  CHECK(run.cameraAt(0, unit) == Camera::framing(unit, {0.0, 0.0, -1.0}, {0.0, 1.0, 0.0}));
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
    if (const json* object = objectIn(part)) compare("/" + name, *object);
  }
  CHECK(seen.size() == config::runFields().size());
}

TEST_CASE("the schema's presets are those that there are, and its defaults those of the code") {
  const json all = schema();
  for (const std::string name : all.at("$defs").at("preset").at("enum"))
    CHECK_NOTHROW(parseRun(R"({"field": "V", "colors": ")" + name + "\"}", "vdi.json"));
  refusedField(R"("colors": "viridis")", "there are Cool to Warm, three-hues, haze, bands, surface;");
  CHECK(all.at("$defs").at("preset").at("enum").size() == 5);
  json given{{"field", "V"}};
  for (const auto& [name, part] : all.at("properties").items()) {
    if (part.contains("default")) given[name] = part.at("default");
  }
  CHECK(given.size() > 6);
  const Run stated = parseRun(given.dump(), "vdi.json");
  const Run implied = parseRun(R"({"field": "V"})", "vdi.json");
  CHECK(stated.settings == implied.settings);
  CHECK(stated.every == implied.every);
  CHECK(stated.component == implied.component);
}

TEST_CASE("everything at once") {
  const Run run = parseRun(R"({
    "field": "u", "association": "points", "component": 2, "every": 4,
    "orbit": {"azimuth": 30, "elevation": 20, "view_up": [0, 0, 1], "zoom": 2, "turn": 10, "view_angle": 40},
    "colors": {"preset": "haze", "range": [0, 2], "opacities": [[0, 0], [2, 0.5]], "unit_distance": 3},
    "resolution": [320, 200], "supersegments": 12, "margin": 0.5, "sampling_rate": 2, "shade": true,
    "output": {"vdi": "a/{timestep}.vdi", "png": "b_{timestep:03d}.png", "latest": true},
    "log": {"json": "run.jsonl", "text": "run.log"},
    "stream": {"host": "::1", "port": 8080, "token_file": "t", "link_file": "l", "certificate": "c", "key": "k",
               "megabits": 100}})",
                           "vdi.json");
  CHECK(run.cells == std::optional<bool>(false));
  CHECK(run.component == 2);
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
  CHECK(run.stream->megabits == 100.0);
  const TransferFunction function = run.transferFunction(std::nullopt, {5.0, 6.0}, 7.0);
  CHECK(function.colors.back().x == 2.0);
  CHECK(function.opacities == std::vector<OpacityNode>{{0.0, 0.0}, {2.0, 0.5}});
  CHECK(function.unitDistance == 3.0);
  const Box unit{glm::dvec3(0.0), glm::dvec3(1.0)};
  CHECK(run.cameraAt(8, unit) ==
        config::orbitCamera(unit, {.azimuth = 50.0, .elevation = 20.0, .up = {0.0, 0.0, 1.0}, .zoom = 2.0},
                            40.0));
}

TEST_CASE("the default colours are ParaView's, over the first frame's range") {
  const Run run = parseRun(R"({"field": "V"})", "vdi.json");
  const TransferFunction function = run.transferFunction(std::nullopt, {2.0, 4.0}, 0.25);
  CHECK(function.opacities == std::vector<OpacityNode>{{2.0, 0.0}, {4.0, 1.0}});
  CHECK(function.colors.front() == ColorNode{2.0, {0.231373, 0.298039, 0.752941}});
  CHECK(function.colors.back().x == 4.0);
  CHECK(function.unitDistance == 0.25);
  CHECK_NOTHROW(validate(function));
  CHECK_NOTHROW(validate(run.transferFunction(std::nullopt, {3.0, 3.0}, 1.0)));
  CHECK_NOTHROW(validate(run.transferFunction(std::nullopt, ScalarRange(), 1.0)));
}

TEST_CASE("mistakes are told with their place") {
  refused("[]", "must be an object (vdi.json, line 1)");
  refused("{\"every\": 10}", "the field 'field' is missing");
  refused(R"({"field": ""})", "/field: must be an array's name");
  refusedField(R"("evry": 10)", "/evry: no such field; there are $schema, field");
  refusedField(R"("every": 0)", "/every: must be a whole number from 1 to 2147483647 (vdi.json, line 2)");
  refusedField(R"("every": "10")", "/every: must be a whole number");
  refusedField(R"("every": 1e400)", "line 2");
  refusedField(R"("association": "nodes")", "/association: must be 'cells' or 'points'");
  refusedField(R"("component": -1)", "/component");
  refusedField(R"("camera": {"position": [0, 0, 1]})", "/camera: the field 'focal_point' is missing");
  refusedField(R"("camera": {"position": [0, 0, 1], "focal_point": [0, 0, 1]})", "/camera: ");
  refusedField(R"("camera": {"position": [0, 0, 1], "focal_point": [0, 0, 0], "view_angle": 180})",
               "/camera/view_angle");
  refusedField(R"("camera": {"position": [0, 0, 1], "focal_point": [0, 0, 0]}, "orbit": {})",
               "/orbit: either");
  refusedField(R"("orbit": {"view_up": [0, 0, 0]})", "/orbit/view_up: must not be zero");
  refusedField(R"("orbit": {"zoom": 0})", "/orbit/zoom: must be from 0.001 to 1000, it is 0");
  refusedField(R"("colors": {"range": [1, 1]})", "/colors/range: the first");
  refusedField(R"("colors": {"range": [-1e308, 1e308]})", "/colors/range: is too wide");
  refusedField(R"("colors": {"range": [NaN, 1]})", "not valid JSON");
  refusedField(R"("colors": {"preset": "haze", "file": "a"})", "/colors/file: either");
  refusedField(R"("colors": {"name": "a"})", "/colors/name");
  refusedField(R"("colors": {"opacities": []})", "/colors/opacities: must have a node");
  refusedField(R"("colors": {"opacities": [[1, 0], [0, 1]]})", "/colors/opacities/1: nodes must ascend");
  refusedField(R"("colors": {"opacities": [[1, 2]]})", "/colors/opacities/0: an opacity");
  refusedField(R"("resolution": [0, 5])", "/resolution/0: must be a whole number from 1 to 32768");
  refusedField(R"("sampling_rate": 65)", "/sampling_rate: ");
  refusedField(R"("output": "a.vdi")", "/output: must contain {timestep}");
  refusedField(R"("output": "{timestep}.jpg")", "/output: must end in .vdi or .png");
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
}

TEST_CASE("text is told from a file's name") {
  CHECK(config::readRun(" {\"field\": \"V\"}").name == "the JSON text");
  CHECK_THROWS_WITH(config::readRun("none.json"), test::ContainsSubstring("none.json"));
}

TEST_CASE("the unit distance is ParaView's") {
  // Of a cube of 10 x 10 x 10 voxels: the diagonal of a voxel.
  CHECK(unitDistanceOf({glm::dvec3(0.0), glm::dvec3(2.0)}, 0.008) == Approx(std::sqrt(3.0) * 0.2));
  CHECK(unitDistanceOf(Box(), 1.0) == 1.0);
}
