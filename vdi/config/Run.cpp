#include "vdi/config/Run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <stdexcept>
#include <utility>

#include "vdi/config/Json.h"
#include "vdi/config/Presets.h"
#include "vdi/core/Error.h"

namespace vdi::config {

namespace {

constexpr const char* placeholder = "{timestep";
constexpr const char* defaultPreset = "Cool to Warm";
constexpr std::int64_t lastStep = std::numeric_limits<std::int32_t>::max();

const std::vector<std::string>& fieldsOf(const char* object) {
  return runFields().at(object);
}

glm::dvec3 vectorOf(const JsonValue& value) {
  const std::vector<double> v = value.numbers(3);
  return {v[0], v[1], v[2]};
}

/// A direction, which has a length that can be computed with.
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

/// Calls `check`; what it throws gets the value's place.
template <typename Check>
auto placed(const JsonValue& value, Check check) {
  try {
    return check();
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
    if (value.find("view_angle")) scale.fail("either this or 'view_angle'");
    camera.parallelProjection = true;
    camera.parallelScale = positiveOf(scale);
  });
  placed(value, [&] { (void)View(camera, 1, 1); });
  return camera;
}

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
  std::string names = defaultPreset;
  if (value.text() == names) return value.text();
  for (const PresetInfo& info : transferFunctionPresets()) {
    if (value.text() == info.name) return info.name;
    names += ", " + info.name;
  }
  value.fail("no such preset; there are " + names + "; others come from a 'file' that ParaView exports");
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
    if (!colors.preset.empty()) file.fail("either this or 'preset'");
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

FilePattern patternOf(const JsonValue& value) {
  const std::string& text = value.text();
  return placed(value, [&] { return FilePattern(text); });
}

void readOutput(const JsonValue& value, Run& run) {
  if (value.isText()) {
    const std::filesystem::path extension = std::filesystem::path(value.text()).extension();
    if (extension != ".vdi" && extension != ".png") value.fail("must end in .vdi or .png");
    (extension == ".vdi" ? run.vdi : run.png) = patternOf(value);
    return;
  }
  value.requireObject(fieldsOf("/output"));
  ifThere(value, "vdi", [&](const JsonValue& file) { run.vdi = patternOf(file); });
  ifThere(value, "png", [&](const JsonValue& file) { run.png = patternOf(file); });
  if (!run.vdi && !run.png) value.fail("must name a file, 'vdi' or 'png'");
  ifThere(value, "latest", [&](const JsonValue& latest) { run.latest = latest.flag(); });
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
  ifThere(value, "megabits", [&](const JsonValue& rate) { stream.megabits = positiveOf(rate); });
  if (stream.certificate.empty() != stream.key.empty()) value.fail("'certificate' and 'key' come together");
  return stream;
}

void readSettings(const JsonValue& document, GenerateSettings& settings) {
  settings.samplesPerVoxel = automaticRate;
  ifThere(document, "resolution", [&](const JsonValue& value) {
    const std::vector<JsonValue> sides = value.items();
    if (sides.size() != 2) value.fail("must be width and height");
    settings.width = static_cast<int>(sides[0].whole(1, View::maxSide));
    settings.height = static_cast<int>(sides[1].whole(1, View::maxSide));
  });
  ifThere(document, "supersegments", [&](const JsonValue& value) {
    settings.supersegments = static_cast<std::uint32_t>(value.whole(1, maxSupersegments));
  });
  ifThere(document, "margin",
          [&](const JsonValue& value) { settings.margin = value.number(0.0, maxMargin); });
  ifThere(document, "sampling_rate", [&](const JsonValue& value) {
    settings.samplesPerVoxel = value.number();
    placed(value, [&] { validate(settings); });
  });
  ifThere(document, "shade", [&](const JsonValue& value) { settings.shading.on = value.flag(); });
}

}  // namespace

FilePattern::FilePattern(const std::string& text) {
  const std::size_t start = text.find(placeholder);
  if (start == std::string::npos)
    throw std::invalid_argument(
        "must contain {timestep}, or {timestep:06d}: each frame has a file of its own");
  const std::size_t end = text.find('}', start);
  if (end == std::string::npos) throw std::invalid_argument("'}' is missing after {timestep");
  front_ = text.substr(0, start);
  back_ = text.substr(end + 1);
  const std::size_t colon = start + std::string(placeholder).size();
  const std::string format = text.substr(colon, end - colon);
  if (!format.empty()) {  // ":06d"
    constexpr int most = 20;
    char* after = nullptr;
    const bool isPadded = format.size() >= 4 && format.size() <= 5 && format[0] == ':' && format[1] == '0';
    const long digits = isPadded ? std::strtol(format.c_str() + 2, &after, 10) : 0;
    if (digits < 1 || digits > most || std::string(after) != "d")
      throw std::invalid_argument("the step's number is {timestep}, or {timestep:06d} with six digits");
    digits_ = static_cast<int>(digits);
  }
  if ((front_ + back_).find_first_of("{}") != std::string::npos)
    throw std::invalid_argument("only {timestep} may stand in braces, once");
  if ((front_ + back_).find('\0') != std::string::npos || !std::filesystem::path(path(0)).has_filename())
    throw std::invalid_argument("isn't a file's name");
}

std::filesystem::path FilePattern::path(std::int64_t step) const {
  return fmt::format("{}{:0{}}{}", front_, step, digits_, back_);
}

Camera Run::cameraAt(std::int64_t step, const Box& bounds) const {
  if (camera) return *camera;
  if (!orbit) {
    const Camera along;
    return Camera::framing(bounds, {0.0, 0.0, -1.0}, along.viewUp, along.viewAngle);
  }
  constexpr double full = 360.0;
  const std::int64_t frame = step / every;
  Orbit place = orbit->start;
  place.azimuth = std::fmod(place.azimuth + orbit->turn * static_cast<double>(frame), full);
  return orbitCamera(bounds, place, orbit->viewAngle);
}

TransferFunction Run::transferFunction(const std::optional<ColorMap>& map, const ScalarRange& range,
                                       double unitDistance) const {
  ScalarRange wide = colors.range.value_or(range);
  if (!(wide.min <= wide.max)) wide = {0.0, 1.0};
  if (wide.min == wide.max) wide.max += 1.0;
  TransferFunction function;
  if (!map && !colors.preset.empty() && colors.preset != defaultPreset) {
    function = presetTransferFunction(colors.preset, wide, 1.0);
  } else {
    const ColorMap scaled = rescaled(map ? *map : coolToWarm(), wide);
    function.colors = scaled.colors;
    function.opacities = scaled.opacities;
    if (function.opacities.empty()) function.opacities = {{wide.min, 0.0}, {wide.max, 1.0}};
  }
  if (!colors.opacities.empty()) function.opacities = colors.opacities;
  function.unitDistance = colors.unitDistance.value_or(unitDistance);
  return function;
}

const std::map<std::string, std::vector<std::string>>& runFields() {
  static const std::map<std::string, std::vector<std::string>> fields{
      {"",
       {"$schema", "field", "association", "component", "every", "camera", "orbit", "colors", "resolution",
        "supersegments", "margin", "sampling_rate", "shade", "output", "stream", "log"}},
      {"/camera", {"position", "focal_point", "view_up", "view_angle", "parallel_scale"}},
      {"/orbit", {"azimuth", "elevation", "view_up", "zoom", "turn", "view_angle"}},
      {"/colors", {"preset", "file", "name", "range", "opacities", "unit_distance"}},
      {"/output", {"vdi", "png", "latest"}},
      {"/stream", {"host", "port", "token_file", "link_file", "certificate", "key", "megabits"}},
      {"/log", {"json", "text"}},
  };
  return fields;
}

Run parseRun(std::string_view text, const std::string& name) {
  const JsonValue document = parseJson(text, name);
  document.requireObject(fieldsOf(""));
  Run run;
  ifThere(document, "$schema", [](const JsonValue& value) { (void)value.text(); });
  const JsonValue field = document.at("field");
  run.field = field.text();
  if (run.field.empty() || run.field.find('\0') != std::string::npos) field.fail("must be an array's name");
  ifThere(document, "association", [&](const JsonValue& value) {
    if (value.text() != "cells" && value.text() != "points") value.fail("must be 'cells' or 'points'");
    run.cells = value.text() == "cells";
  });
  ifThere(document, "component", [&](const JsonValue& value) {
    constexpr std::int64_t last = 15;
    if (value.isText() && value.text() == "magnitude") return;
    if (value.isText()) value.fail("must be a number from 0 on, or 'magnitude'");
    run.component = static_cast<int>(value.whole(0, last));
  });
  ifThere(document, "every", [&](const JsonValue& value) { run.every = value.whole(1, lastStep); });
  ifThere(document, "camera", [&](const JsonValue& value) { run.camera = cameraOf(value); });
  ifThere(document, "orbit", [&](const JsonValue& value) {
    if (run.camera) value.fail("either this or 'camera'");
    run.orbit = orbitOf(value);
  });
  ifThere(document, "colors", [&](const JsonValue& value) { run.colors = colorsOf(value); });
  readSettings(document, run.settings);
  ifThere(document, "stream", [&](const JsonValue& value) { run.stream = streamOf(value); });
  ifThere(document, "output", [&](const JsonValue& value) { readOutput(value, run); });
  ifThere(document, "log", [&](const JsonValue& value) { run.log = logOf(value); });
  if (!run.vdi && !run.png && !run.stream) run.vdi = FilePattern("vdi_{timestep:06d}.vdi");
  return run;
}

RunText readRun(const std::string& fileOrText) {
  const std::size_t first = fileOrText.find_first_not_of(" \t\r\n");
  if (first != std::string::npos && fileOrText[first] == '{') return {fileOrText, "the JSON text", {}};
  return {readJsonText(fileOrText), fileOrText, std::filesystem::path(fileOrText).parent_path()};
}

std::optional<std::string> readColorsFile(const Run& run, const RunText& source) {
  if (run.colors.file.empty()) return std::nullopt;
  return readJsonText((source.folder / run.colors.file).string(), presetLimits);
}

}  // namespace vdi::config
