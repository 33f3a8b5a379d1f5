// Reads a run's JSON, and reports each mistake with its place.
#include <fmt/format.h>
#include <fmt/ranges.h>  // fmt::join

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <set>
#include <string_view>
#include <utility>

#include "vdi/config/Run.h"
#include "vdi/core/ComponentValues.h"
#include "vdi/core/Error.h"
#include "vdi/core/SettingsTable.h"
#include "vdi/io/Json.h"

namespace vdi::config {

using io::JsonValue;
using io::parseJson;

namespace {

constexpr std::int64_t lastStep = std::numeric_limits<std::int32_t>::max();
constexpr std::int64_t mostCameras = 1000;

const std::vector<std::string>& fieldsOf(const char* object) {
  return runFields().at(object);
}

glm::dvec3 vectorOf(const JsonValue& value) {
  const std::vector<double> v = value.numbers(3);
  return {v[0], v[1], v[2]};
}

/// A direction whose length can be computed.
glm::dvec3 directionOf(const JsonValue& value) {
  constexpr double extreme = 1e100;
  const glm::dvec3 direction = vectorOf(value);
  const double length = glm::length(direction);
  if (!(length > 0.0)) value.fail("must not be zero");
  if (!(length > 1.0 / extreme && length < extreme)) value.fail("is too short or too long");
  return direction;
}

/// Runs `read` with the field's value if the object has it.
template <typename Read>
void ifThere(const JsonValue& object, const char* name, Read read) {
  if (const std::optional<JsonValue> value = object.find(name)) read(*value);
}

/// Calls `check`, and adds the value's place to an error that it throws.
template <typename Check>
auto placed(const JsonValue& value, Check check) {
  try {
    return check();
  } catch (const std::bad_alloc&) {
    throw;  // no fault of the value
  } catch (const std::exception& error) {
    value.fail(error.what());
  }
}

double viewAngleOf(const JsonValue& value) {
  const double angle = value.number();
  if (!(angle > 0.0 && angle < 180.0)) value.fail("must lie between 0 and 180 degrees");
  return angle;
}

double positiveOf(const JsonValue& value) {
  const double number = value.number();
  if (!(number > 0.0)) value.fail("must be > 0");
  return number;
}

Camera cameraOf(const JsonValue& value) {
  value.requireObject(fieldsOf("/camera"));
  Camera camera;
  camera.position = vectorOf(value.at("position"));
  camera.focalPoint = vectorOf(value.at("focal_point"));
  ifThere(value, "view_up", [&](const JsonValue& up) { camera.viewUp = directionOf(up); });
  ifThere(value, "view_angle", [&](const JsonValue& angle) { camera.viewAngle = viewAngleOf(angle); });
  ifThere(value, "parallel_scale", [&](const JsonValue& scale) {
    if (value.find("view_angle")) scale.fail("can't be combined with 'view_angle'");
    camera.parallelProjection = true;
    camera.parallelScale = positiveOf(scale);
  });
  placed(value, [&] { (void)View(camera, 1, 1); });
  return camera;
}

/// One viewpoint of an orbit.
RunOrbit orbitOf(const JsonValue& value) {
  value.requireObject(fieldsOf("/orbit"));
  constexpr double pole = 90.0;
  constexpr double turns = 3600.0;
  constexpr double mostZoom = 1000.0;
  RunOrbit orbit;
  ifThere(value, "azimuth",
          [&](const JsonValue& angle) { orbit.start.azimuth = angle.number(-turns, turns); });
  ifThere(value, "elevation",
          [&](const JsonValue& angle) { orbit.start.elevation = angle.number(-pole, pole); });
  ifThere(value, "view_up", [&](const JsonValue& up) { orbit.start.up = directionOf(up); });
  ifThere(value, "zoom",
          [&](const JsonValue& zoom) { orbit.start.zoom = zoom.number(1.0 / mostZoom, mostZoom); });
  ifThere(value, "turn", [&](const JsonValue& angle) { orbit.turn = angle.number(-turns, turns); });
  ifThere(value, "view_angle", [&](const JsonValue& angle) { orbit.viewAngle = angle.number(1.0, 179.0); });
  return orbit;
}

std::vector<double> elevationsOf(const JsonValue& value) {
  constexpr double pole = 90.0;
  std::vector<double> elevations;
  for (const JsonValue& item : value.items()) {
    elevations.push_back(item.number(-pole, pole));
    if (std::count(elevations.begin(), elevations.end(), elevations.back()) > 1) item.fail("occurs twice");
  }
  if (elevations.empty()) value.fail("must have an elevation");
  return elevations;
}

/// All viewpoints of an orbit: a single unnamed one, or `count` numbered ones about the axis at each
/// elevation.
std::vector<RunCamera> camerasOfOrbit(const JsonValue& value) {
  const RunOrbit orbit = orbitOf(value);
  const std::optional<JsonValue> count = value.find("count");
  const std::optional<JsonValue> elevations = value.find("elevations");
  if (!count && !elevations) return {{"", std::nullopt, orbit}};
  if (const auto turn = value.find("turn")) turn->fail("can't be combined with several viewpoints");
  if (elevations && value.find("elevation")) elevations->fail("can't be combined with 'elevation'");
  const std::int64_t azimuths = count ? count->whole(1, mostCameras) : 1;
  const std::vector<double> angles =
      elevations ? elevationsOf(*elevations) : std::vector<double>{orbit.start.elevation};
  const auto all = azimuths * static_cast<std::int64_t>(angles.size());
  if (all > mostCameras) value.fail(fmt::format("{} viewpoints; at most {} are allowed", all, mostCameras));
  const std::size_t digits = std::to_string(all - 1).size();
  std::vector<RunCamera> cameras;
  for (const double elevation : angles) {
    for (std::int64_t i = 0; i < azimuths; ++i) {
      RunCamera camera{fmt::format("{:0{}}", cameras.size(), digits), std::nullopt, orbit};
      camera.orbit->start.elevation = elevation;
      camera.orbit->start.azimuth += 360.0 * static_cast<double>(i) / static_cast<double>(azimuths);
      cameras.push_back(std::move(camera));
    }
  }
  return cameras;
}

/// Whether a camera or field of this name can have files.
bool namesFiles(const std::string& name) {
  constexpr std::string_view letters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-.";
  constexpr std::size_t longest = 64;
  return !name.empty() && name.size() <= longest && name[0] != '.' &&
         name.find_first_not_of(letters) == std::string::npos;
}
constexpr const char* nameRule = "1 to 64 letters, digits, '_', '-' and '.'; it must not start with '.'";

std::string fileNameOf(const JsonValue& value, const char* whose) {
  const std::string& name = value.text();
  if (!namesFiles(name)) value.fail(fmt::format("a {}'s name has {}", whose, nameRule));
  return name;
}

RunCamera namedCameraOf(const JsonValue& value) {
  value.requireObject(fieldsOf("/cameras/*"));
  RunCamera camera;
  camera.name = fileNameOf(value.at("name"), "camera");
  ifThere(value, "camera", [&](const JsonValue& fixed) { camera.fixed = cameraOf(fixed); });
  ifThere(value, "orbit", [&](const JsonValue& orbit) {
    if (camera.fixed) orbit.fail("can't be combined with 'camera'");
    for (const char* name : {"count", "elevations"})
      ifThere(orbit, name,
              [](const JsonValue& several) { several.fail("a camera of 'cameras' is one viewpoint"); });
    camera.orbit = orbitOf(orbit);
  });
  if (!camera.fixed && !camera.orbit) value.fail("must have a 'camera' or an 'orbit'");
  return camera;
}

std::vector<RunCamera> camerasOf(const JsonValue& value) {
  std::vector<RunCamera> cameras;
  std::set<std::string> names;
  for (const JsonValue& item : value.items()) {
    if (cameras.size() >= static_cast<std::size_t>(mostCameras))
      value.fail(fmt::format("a run can have at most {} cameras", mostCameras));
    cameras.push_back(namedCameraOf(item));
    if (!names.insert(cameras.back().name).second) item.at("name").fail("another camera has this name");
  }
  if (cameras.empty()) value.fail("must have a camera");
  return cameras;
}

void readCameras(const JsonValue& document, Run& run) {
  ifThere(document, "camera", [&](const JsonValue& value) { run.cameras.front().fixed = cameraOf(value); });
  ifThere(document, "orbit", [&](const JsonValue& value) {
    if (document.find("camera")) value.fail("can't be combined with 'camera'");
    run.cameras = camerasOfOrbit(value);
  });
  ifThere(document, "cameras", [&](const JsonValue& value) {
    for (const char* other : {"camera", "orbit"}) {
      if (document.find(other)) value.fail(fmt::format("can't be combined with '{}'", other));
    }
    run.cameras = camerasOf(value);
  });
  // After a restart, the step or the time must determine an orbit's place.
  const bool turns = std::ranges::any_of(
      run.cameras, [](const RunCamera& camera) { return camera.orbit && camera.orbit->turn != 0.0; });
  const bool areCounted = !run.everySeconds && (run.every > 0) != run.everyTime.has_value();
  if (turns && !areCounted) document.fail("an orbit's 'turn' goes with only one of 'every' and 'every_time'");
}

/// `isShown`: of the shown field, else of a condition's.
int componentOf(const JsonValue& value, bool isShown) {
  constexpr std::int64_t last = 15;
  if (value.isText() && value.text() == "magnitude") return magnitude;
  if (value.isText() && value.text() == "phase") return phase;
  if (value.isText() && value.text() == "together" && isShown) return together;
  if (value.isText())
    value.fail(isShown ? "must be a number from 0 on, 'magnitude', 'phase' or 'together'"
                       : "must be a number from 0 on, 'magnitude' or 'phase'");
  return static_cast<int>(value.whole(0, last));
}

bool areCells(const JsonValue& value) {
  if (value.text() != "cells" && value.text() != "points") value.fail("must be 'cells' or 'points'");
  return value.text() == "cells";
}

std::string arrayNameOf(const JsonValue& value) {
  const std::string& name = value.text();
  if (name.empty() || name.find('\0') != std::string::npos) value.fail("must be an array's name");
  return name;
}

std::vector<double> missingOf(const JsonValue& value) {
  constexpr std::size_t most = 64;
  std::vector<double> missing;
  for (const JsonValue& item : value.items()) missing.push_back(item.number());
  if (missing.size() > most) value.fail(fmt::format("at most {} numbers may stand for missing values", most));
  return missing;
}

RunCondition conditionOf(const JsonValue& value) {
  using Measure = RunCondition::Measure;
  value.requireObject(fieldsOf("/when"));
  RunCondition condition;
  int measures = 0;
  for (const auto& [name, measure] :
       {std::pair("max", Measure::Max), std::pair("min", Measure::Min), std::pair("mean", Measure::Mean),
        std::pair("change", Measure::Change)}) {
    ifThere(value, name, [&, which = measure](const JsonValue& field) {
      if (++measures > 1) field.fail("a condition has one of 'max', 'min', 'mean' and 'change'");
      condition.measure = which;
      condition.field = arrayNameOf(field);
    });
  }
  if (measures == 0) value.fail("must have 'max', 'min', 'mean' or 'change', with an array's name");
  ifThere(value, "association", [&](const JsonValue& kind) { condition.cells = areCells(kind); });
  ifThere(value, "component",
          [&](const JsonValue& component) { condition.component = componentOf(component, false); });
  ifThere(value, "above", [&](const JsonValue& bound) { condition.above = bound.number(); });
  ifThere(value, "below", [&](const JsonValue& bound) { condition.below = bound.number(); });
  if (!condition.above && !condition.below) value.fail("must have a bound, 'above' or 'below'");
  if (condition.above && condition.below && !(*condition.above < *condition.below))
    value.fail("never holds: 'above' must be less than 'below'");
  return condition;
}

void readTriggers(const JsonValue& document, Run& run) {
  ifThere(document, "every_time", [&](const JsonValue& value) { run.everyTime = positiveOf(value); });
  ifThere(document, "every_seconds", [&](const JsonValue& value) { run.everySeconds = positiveOf(value); });
  if (run.everyTime || run.everySeconds) run.every = 0;
  ifThere(document, "every", [&](const JsonValue& value) { run.every = value.whole(1, lastStep); });
  ifThere(document, "when", [&](const JsonValue& value) { run.when = conditionOf(value); });
  ifThere(document, "max_share", [&](const JsonValue& value) {
    run.maxShare = positiveOf(value);
    if (*run.maxShare > 1.0) value.fail("is a share, 1 at most");
  });
  constexpr std::int64_t mostMebibytes = std::int64_t{1} << 24;  // 16 TiB
  constexpr std::int64_t staging = 32;  // the buffer through which values travel, in MiB
  ifThere(document, "max_device_mib", [&](const JsonValue& value) {
    run.maxDeviceMiB = value.whole(1, mostMebibytes);
    if (*run.maxDeviceMiB < staging)
      value.fail(
          fmt::format("must be at least {}, beside the volume: values are staged in that many MiB", staging));
  });
  ifThere(document, "max_host_mib",
          [&](const JsonValue& value) { run.maxHostMiB = value.whole(1, mostMebibytes); });
}

Existing existingOf(const JsonValue& value) {
  if (value.text() == "refuse") return Existing::Refuse;
  if (value.text() == "overwrite") return Existing::Overwrite;
  if (value.text() == "continue") return Existing::Continue;
  value.fail("must be 'refuse', 'overwrite' or 'continue'");
}

ScalarRange rangeOf(const JsonValue& value) {
  const std::vector<double> ends = value.numbers(2);
  if (!(ends[0] < ends[1])) value.fail("the first number must be the smaller one");
  if (!std::isfinite(ends[1] - ends[0])) value.fail("is too wide");
  return {ends[0], ends[1]};
}

std::vector<OpacityNode> opacitiesOf(const JsonValue& value) {
  std::vector<OpacityNode> nodes;
  for (const JsonValue& item : value.items()) {
    const std::vector<double> node = item.numbers(2);
    if (!(node[1] >= 0.0 && node[1] <= 1.0)) item.fail("an opacity must be from 0 to 1");
    if (!nodes.empty() && node[0] < nodes.back().x) item.fail("nodes must ascend in their first number");
    nodes.push_back({node[0], node[1]});
  }
  if (nodes.empty()) value.fail("must have a node");
  return nodes;
}

std::string presetOf(const JsonValue& value) {
  const std::vector<std::string> names = presetNames();
  if (std::ranges::find(names, value.text()) == names.end()) {
    value.fail(fmt::format("no such preset; use one of {}; others come from a 'file' that ParaView exports",
                           fmt::join(names, ", ")));
  }
  return value.text();
}

RunColors colorsOf(const JsonValue& value) {
  RunColors colors;
  if (value.isText()) {
    colors.preset = presetOf(value);
    return colors;
  }
  value.requireObject(fieldsOf("/colors"));
  ifThere(value, "preset", [&](const JsonValue& name) { colors.preset = presetOf(name); });
  ifThere(value, "file", [&](const JsonValue& file) {
    if (!colors.preset.empty()) file.fail("can't be combined with 'preset'");
    colors.file = file.text();
    if (colors.file.empty()) file.fail("must name a file");
  });
  ifThere(value, "name", [&](const JsonValue& name) {
    if (colors.file.empty()) name.fail("names a preset in 'file', which is missing");
    colors.name = name.text();
  });
  ifThere(value, "range", [&](const JsonValue& range) { colors.range = rangeOf(range); });
  ifThere(value, "opacities", [&](const JsonValue& nodes) { colors.opacities = opacitiesOf(nodes); });
  ifThere(value, "unit_distance",
          [&](const JsonValue& distance) { colors.unitDistance = positiveOf(distance); });
  return colors;
}

/// Refuses names of fields and cameras that make one file's name together, such as a_b and c, and a and b_c.
void requireDistinct(const JsonValue& value, const FilePattern& pattern, const Run& run) {
  if (run.fields.size() == 1 || run.cameras.size() == 1) return;
  std::set<std::filesystem::path> paths;
  for (const RunField& field : run.fields) {
    for (const RunCamera& camera : run.cameras) {
      const auto [path, isNew] = paths.insert(pattern.path(0, camera.name, field.name));
      if (isNew) continue;
      value.fail(fmt::format("field '{}' from camera '{}' has the same file as another field and camera, {}",
                             field.name, camera.name, path->string()));
    }
  }
}

FilePattern patternOf(const JsonValue& value, const Run& run) {
  const std::string& text = value.text();
  FilePattern pattern = placed(value, [&] { return FilePattern(text); });
  if (pattern.namesCamera() && run.cameras.front().name.empty())
    value.fail("{camera} needs several viewpoints");
  if (pattern.namesField() && run.fields.front().name.empty()) value.fail("{field} needs 'fields'");
  requireDistinct(value, pattern, run);
  return pattern;
}

RunCinema cinemaOf(const JsonValue& value, const Run& run) {
  const std::filesystem::path folder = value.text();
  if (folder.extension() != ".cdb" || value.text().find_first_of(std::string("{}\0", 3)) != std::string::npos)
    value.fail("must be a folder's name that ends in .cdb");
  const bool areOrbits =
      std::ranges::all_of(run.cameras, [](const RunCamera& one) { return one.orbit.has_value(); });
  if (!areOrbits) value.fail("a Cinema database needs an 'orbit'");
  std::string pictures = "{timestep:06d}";
  if (!run.fields.front().name.empty()) pictures += "/{field}";
  if (!run.cameras.front().name.empty()) pictures += "/{camera}";
  return {folder, FilePattern((folder / (pictures + ".png")).string())};
}

void readOutput(const JsonValue& value, Run& run) {
  if (value.isText()) {
    const std::filesystem::path extension = std::filesystem::path(value.text()).extension();
    if (extension == ".cdb") {
      run.cinema = cinemaOf(value, run);
    } else if (extension == ".vdi") {
      run.vdi = patternOf(value, run);
    } else if (extension == ".png") {
      run.png = patternOf(value, run);
    } else {
      value.fail("must end in .vdi, .png or .cdb");
    }
    return;
  }
  value.requireObject(fieldsOf("/output"));
  ifThere(value, "vdi", [&](const JsonValue& file) { run.vdi = patternOf(file, run); });
  ifThere(value, "png", [&](const JsonValue& file) { run.png = patternOf(file, run); });
  ifThere(value, "cinema", [&](const JsonValue& folder) { run.cinema = cinemaOf(folder, run); });
  if (!run.vdi && !run.makesPictures()) value.fail("must name a file, 'vdi', 'png' or 'cinema'");
  ifThere(value, "latest", [&](const JsonValue& latest) {
    run.latest = latest.flag();
    if (!run.latest) return;
    if (!run.vdi && !run.png) latest.fail("needs 'vdi' or 'png', whose newest files it links");
    requireDistinct(latest, FilePattern("latest{timestep}"), run);
  });
}

std::string logFileOf(const JsonValue& value) {
  const std::string& name = value.text();
  if (name.find('\0') != std::string::npos || !std::filesystem::path(name).has_filename())
    value.fail("must be a file's name");
  return name;
}

RunLogFiles logOf(const JsonValue& value) {
  RunLogFiles files;
  if (value.isText()) {
    const std::filesystem::path extension = std::filesystem::path(value.text()).extension();
    if (extension != ".jsonl" && extension != ".log")
      value.fail("must end in .jsonl, for lines of JSON, or in .log, for text");
    (extension == ".jsonl" ? files.json : files.text) = logFileOf(value);
    return files;
  }
  value.requireObject(fieldsOf("/log"));
  ifThere(value, "json", [&](const JsonValue& file) { files.json = logFileOf(file); });
  ifThere(value, "text", [&](const JsonValue& file) { files.text = logFileOf(file); });
  if (!files.any()) value.fail("must name a file, 'json' or 'text'");
  if (files.json == files.text) value.fail("'json' and 'text' must be two files");
  return files;
}

/// Origins of sites. The server checks how they are written.
std::vector<std::string> originsOf(const JsonValue& value) {
  std::vector<std::string> origins;
  for (const JsonValue& origin : value.items()) origins.push_back(origin.text());
  return origins;
}

std::optional<RunStream> streamOf(const JsonValue& value) {
  if (value.isFlag()) return value.flag() ? std::optional<RunStream>(RunStream()) : std::nullopt;
  value.requireObject(fieldsOf("/stream"));
  constexpr std::int64_t lastPort = 65535;
  RunStream stream;
  ifThere(value, "host", [&](const JsonValue& host) { stream.host = host.text(); });
  ifThere(value, "port",
          [&](const JsonValue& port) { stream.port = static_cast<std::uint16_t>(port.whole(0, lastPort)); });
  ifThere(value, "token_file", [&](const JsonValue& file) { stream.tokenFile = file.text(); });
  ifThere(value, "link_file", [&](const JsonValue& file) { stream.linkFile = file.text(); });
  ifThere(value, "certificate", [&](const JsonValue& file) { stream.certificate = file.text(); });
  ifThere(value, "key", [&](const JsonValue& file) { stream.key = file.text(); });
  ifThere(value, "origins", [&](const JsonValue& origins) { stream.origins = originsOf(origins); });
  ifThere(value, "embed_in", [&](const JsonValue& origins) { stream.embedIn = originsOf(origins); });
  ifThere(value, "title", [&](const JsonValue& title) { stream.title = title.text(); });
  ifThere(value, "megabits", [&](const JsonValue& rate) { stream.megabits = positiveOf(rate); });
  ifThere(value, "steer", [&](const JsonValue& steer) { stream.steer = steer.flag(); });
  ifThere(value, "steering_log", [&](const JsonValue& file) {
    if (!stream.steer) file.fail("needs \"steer\": true");
    stream.steeringLog = file.text();
  });
  if (stream.certificate.empty() != stream.key.empty()) value.fail("'certificate' and 'key' come together");
  return stream;
}

RunIsolation isolationOf(const JsonValue& value) {
  RunIsolation isolation;
  if (value.isText()) {
    if (value.text() != "process") value.fail("must be 'process', or an object");
    return isolation;
  }
  value.requireObject(fieldsOf("/isolation"));
  constexpr double longest = 1e6;
  ifThere(value, "restart", [&](const JsonValue& restart) { isolation.restart = restart.flag(); });
  ifThere(value, "patience",
          [&](const JsonValue& seconds) { isolation.patience = seconds.number(0.0, longest); });
  return isolation;
}

double numberOf(const JsonValue& value, const Setting& setting) {
  switch (setting.kind) {
    case Setting::Kind::Flag:
      return value.flag() ? 1.0 : 0.0;
    case Setting::Kind::Name:
      return placed(value, [&] { return setting.named(value.text()); });
    default:
      return value.number();
  }
}

void readSetting(const JsonValue& object, const Setting& setting, GenerateSettings& settings) {
  ifThere(object, setting.key, [&](const JsonValue& value) {
    const double number = numberOf(value, setting);
    placed(value, [&] { setting.set(settings, number); });
  });
}

void readSettings(const JsonValue& document, GenerateSettings& settings) {
  settings.samplesPerVoxel = automaticRate;
  ifThere(document, "resolution", [&](const JsonValue& value) {
    const std::vector<JsonValue> sides = value.items();
    if (sides.size() != 2) value.fail("must be width and height");
    settings.width = static_cast<int>(sides[0].whole(1, View::maxSide));
    settings.height = static_cast<int>(sides[1].whole(1, View::maxSide));
  });
  for (const Setting& setting : settingsTable()) readSetting(document, setting, settings);
  placed(document, [&] { validate(settings); });
}

/// The entries that the document has for all fields, and each field for itself.
void readShown(const JsonValue& object, RunField& field) {
  ifThere(object, "association", [&](const JsonValue& value) { field.cells = areCells(value); });
  ifThere(object, "component", [&](const JsonValue& value) { field.component = componentOf(value, true); });
  ifThere(object, "missing", [&](const JsonValue& value) { field.missing = missingOf(value); });
  ifThere(object, "colors", [&](const JsonValue& value) { field.colors = colorsOf(value); });
  GenerateSettings settings;
  settings.interpolation = field.interpolation;
  readSetting(object, settingsTable()[indexOfSetting("InterpolationType")], settings);
  field.interpolation = settings.interpolation;
}

/// One of several fields, which has the document's entries where it has none of its own.
RunField listedFieldOf(const JsonValue& value, RunField field) {
  if (value.isText()) {
    field.array = arrayNameOf(value);
  } else {
    value.requireObject(fieldsOf("/fields/*"));
    field.array = arrayNameOf(value.at("field"));
    readShown(value, field);
    if (const std::optional<JsonValue> name = value.find("name")) {
      field.name = fileNameOf(*name, "field");
      return field;
    }
  }
  field.name = field.array;
  if (!namesFiles(field.name))
    value.fail(fmt::format("files can't have this array's name; add a 'name' of {}", nameRule));
  return field;
}

void readFields(const JsonValue& document, Run& run) {
  RunField common;
  readShown(document, common);
  const std::optional<JsonValue> list = document.find("fields");
  if (!list) {
    common.array = arrayNameOf(document.at("field"));
    run.fields = {std::move(common)};
    return;
  }
  ifThere(document, "field", [](const JsonValue& one) { one.fail("can't be combined with 'fields'"); });
  constexpr std::size_t most = 64;
  run.fields.clear();
  for (const JsonValue& item : list->items()) {
    if (run.fields.size() == most) list->fail(fmt::format("a run can have at most {} fields", most));
    RunField field = listedFieldOf(item, common);
    const auto hasName = [&](const RunField& other) { return other.name == field.name; };
    if (std::ranges::any_of(run.fields, hasName))
      item.fail(fmt::format("another field has the name '{}'; a 'name' tells them apart", field.name));
    run.fields.push_back(std::move(field));
  }
  if (run.fields.empty()) list->fail("must have a field");
}

/// The numbers that stand for missing values in an array: those of the first field that shows it, else the
/// document's.
std::vector<double> missingIn(const std::string& array, const JsonValue& document, const Run& run) {
  const auto shows = [&](const RunField& field) { return field.array == array; };
  const auto shown = std::ranges::find_if(run.fields, shows);
  if (shown != run.fields.end()) return shown->missing;
  const std::optional<JsonValue> common = document.find("missing");
  return common ? missingOf(*common) : std::vector<double>();
}

/// The fields of the whole document.
std::vector<std::string> documentFields() {
  std::vector<std::string> fields{
      "$schema",      "field",      "fields",        "association", "component", "missing",
      "every",        "every_time", "every_seconds", "when",        "max_share", "max_device_mib",
      "max_host_mib", "existing",   "camera",        "cameras",     "orbit",     "colors",
      "resolution",   "output",     "stream",        "log",         "isolation"};
  for (const Setting& setting : settingsTable()) fields.emplace_back(setting.key);
  return fields;
}

}  // namespace

const std::map<std::string, std::vector<std::string>>& runFields() {
  static const std::map<std::string, std::vector<std::string>> fields{
      {"", documentFields()},
      {"/fields/*", {"field", "name", "association", "component", "missing", "colors", "interpolation"}},
      {"/when", {"max", "min", "mean", "change", "association", "component", "above", "below"}},
      {"/cameras/*", {"name", "camera", "orbit"}},
      {"/camera", {"position", "focal_point", "view_up", "view_angle", "parallel_scale"}},
      {"/orbit", {"azimuth", "elevation", "view_up", "zoom", "turn", "view_angle", "count", "elevations"}},
      {"/colors", {"preset", "file", "name", "range", "opacities", "unit_distance"}},
      {"/output", {"vdi", "png", "cinema", "latest"}},
      {"/stream",
       {"host", "port", "token_file", "link_file", "certificate", "key", "origins", "embed_in", "title",
        "megabits", "steer", "steering_log"}},
      {"/log", {"json", "text"}},
      {"/isolation", {"restart", "patience"}},
  };
  return fields;
}

Run parseRun(std::string_view text, const std::string& name) {
  const JsonValue document = parseJson(text, name);
  document.requireObject(fieldsOf(""));
  Run run;
  ifThere(document, "$schema", [](const JsonValue& value) { (void)value.text(); });
  readFields(document, run);
  readTriggers(document, run);
  if (run.when) run.when->missing = missingIn(run.when->field, document, run);
  ifThere(document, "existing", [&](const JsonValue& value) { run.existing = existingOf(value); });
  readCameras(document, run);
  readSettings(document, run.settings);
  ifThere(document, "stream", [&](const JsonValue& value) { run.stream = streamOf(value); });
  ifThere(document, "output", [&](const JsonValue& value) { readOutput(value, run); });
  ifThere(document, "log", [&](const JsonValue& value) { run.log = logOf(value); });
  ifThere(document, "isolation", [&](const JsonValue& value) { run.isolation = isolationOf(value); });
  if (run.stream && !run.vdi && !run.makesPictures()) {
    if (run.cameras.size() > 1)
      document.fail("several viewpoints need an 'output': the stream shows only the first");
    if (run.fields.size() > 1)
      document.fail("several fields need an 'output': the stream shows only the first");
  }
  if (!run.vdi && !run.makesPictures() && !run.stream) {
    run.vdi = FilePattern("vdi_{timestep:06d}.vdi");
    requireDistinct(document, *run.vdi, run);
  }
  return run;
}

}  // namespace vdi::config
