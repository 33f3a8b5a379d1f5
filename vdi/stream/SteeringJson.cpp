#include "vdi/stream/SteeringJson.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "vdi/core/Budget.h"
#include "vdi/core/Error.h"
#include "vdi/core/SettingsTable.h"

namespace vdi::stream {

namespace {

using Json = nlohmann::json;

constexpr std::size_t maxPresets = 64;

/// The field of an object; null if it is missing.
const Json& at(const Json& object, const char* name) {
  static const Json none;
  const auto found = object.find(name);
  return found == object.end() ? none : *found;
}

double numberIn(const Json& value, const char* name) {
  if (!value.is_number() || !std::isfinite(value.get<double>()))
    refuse(fmt::format("\"{}\" isn't a finite number", name));
  return value.get<double>();
}

int wholeIn(const Json& value, const char* name, int low, int high) {
  if (!value.is_number_integer() || value < low || value > high)
    refuse(fmt::format("\"{}\" isn't a whole number from {} to {}", name, low, high));
  return value.get<int>();
}

bool flagIn(const Json& value, const char* name) {
  if (!value.is_boolean()) refuse(fmt::format("\"{}\" isn't true or false", name));
  return value.get<bool>();
}

std::string textIn(const Json& value, const char* name) {
  if (!value.is_string() || value.get_ref<const std::string&>().size() > maxNameBytes)
    refuse(fmt::format("\"{}\" isn't a string of at most {} bytes", name, maxNameBytes));
  return value.get<std::string>();
}

const Json& arrayIn(const Json& value, const char* name, std::size_t least, std::size_t most) {
  if (!value.is_array() || value.size() < least || value.size() > most)
    refuse(fmt::format("\"{}\" isn't an array of {} to {} entries", name, least, most));
  return value;
}

std::array<double, 2> rangeIn(const Json& value) {
  arrayIn(value, "range", 2, 2);
  const std::array range{numberIn(value[0], "range"), numberIn(value[1], "range")};
  if (!(range[0] < range[1]) || !std::isfinite(range[1] - range[0])) refuse("\"range\" doesn't rise");
  return range;
}

std::array<int, 2> resolutionIn(const Json& value, int least) {
  arrayIn(value, "resolution", 2, 2);
  return {wholeIn(value[0], "resolution", least, View::maxSide),
          wholeIn(value[1], "resolution", least, View::maxSide)};
}

glm::dvec3 vectorIn(const Json& value, const char* name) {
  arrayIn(value, name, 3, 3);
  return {numberIn(value[0], name), numberIn(value[1], name), numberIn(value[2], name)};
}

Camera cameraIn(const Json& value) {
  if (!value.is_object()) refuse("\"camera\" isn't an object");
  Camera camera;
  camera.position = vectorIn(at(value, "position"), "position");
  camera.focalPoint = vectorIn(at(value, "focalPoint"), "focalPoint");
  camera.viewUp = vectorIn(at(value, "viewUp"), "viewUp");
  camera.parallelProjection = !at(value, "parallelScale").is_null();
  if (camera.parallelProjection) {
    camera.parallelScale = numberIn(value["parallelScale"], "parallelScale");
  } else {
    camera.viewAngle = numberIn(at(value, "viewAngle"), "viewAngle");
  }
  try {
    (void)View(camera, 1, 1);
  } catch (const Error& error) {
    refuse(fmt::format("\"camera\": {}", error.what()));
  }
  return camera;
}

Json jsonOf(const glm::dvec3& vector) {
  return Json::array({vector.x, vector.y, vector.z});
}

Json jsonOf(const Camera& camera) {
  Json object{{"position", jsonOf(camera.position)},
              {"focalPoint", jsonOf(camera.focalPoint)},
              {"viewUp", jsonOf(camera.viewUp)}};
  if (camera.parallelProjection) {
    object["parallelScale"] = camera.parallelScale;
  } else {
    object["viewAngle"] = camera.viewAngle;
  }
  return object;
}

std::string nameIn(const std::string& name) {
  if (!isParameterName(name)) refuse("a parameter's name may only contain letters, digits, '_', '-' and '.'");
  return name;
}

Parameter parameterIn(const Json& value) {
  if (!value.is_object()) refuse("\"parameters\" has an entry that isn't an object");
  Parameter parameter;
  parameter.name = nameIn(textIn(at(value, "name"), "name"));
  parameter.isWhole = flagIn(at(value, "whole"), "whole");
  parameter.value = numberIn(at(value, "value"), "value");
  parameter.low = numberIn(at(value, "low"), "low");
  parameter.high = numberIn(at(value, "high"), "high");
  if (!(parameter.low <= parameter.value && parameter.value <= parameter.high))
    refuse("a parameter is out of its bounds");
  return parameter;
}

double samplingRateIn(const Json& value) {
  const double rate = numberIn(value, "sampling_rate");
  try {
    settingsTable()[indexOfSetting("SamplingRate")].check(rate);
  } catch (const Error& error) {
    refuse(fmt::format("\"sampling_rate\": {}", error.what()));
  }
  return rate;
}

GeneratorControls generatorIn(const Json& value) {
  if (!value.is_object()) refuse("\"generator\" isn't an object");
  GeneratorControls controls;
  controls.resolution = resolutionIn(at(value, "resolution"), 0);
  controls.supersegments = wholeIn(at(value, "supersegments"), "supersegments", 0, maxSupersegments);
  if (!at(value, "range").is_null()) controls.range = rangeIn(value["range"]);
  for (const Json& preset : arrayIn(at(value, "presets"), "presets", 0, maxPresets))
    controls.presets.push_back(textIn(preset, "presets"));
  if (!at(value, "sampling_rate").is_null()) controls.samplingRate = samplingRateIn(value["sampling_rate"]);
  return controls;
}

}  // namespace

void refuse(const std::string& what) {
  throw Error(ErrorCode::Format, what);
}

Json jsonOf(const Wish& wish) {
  Json object = Json::object();
  if (wish.camera) object["camera"] = jsonOf(*wish.camera);
  if (wish.resolution) object["resolution"] = *wish.resolution;
  if (wish.supersegments) object["supersegments"] = *wish.supersegments;
  if (wish.samplingRate) object["sampling_rate"] = *wish.samplingRate;
  if (wish.range) object["range"] = *wish.range;
  if (wish.preset) object["preset"] = *wish.preset;
  if (wish.period) object["period"] = *wish.period;
  if (wish.paused) object["paused"] = *wish.paused;
  if (!wish.parameters.empty()) object["parameters"] = wish.parameters;
  return object;
}

Wish wishIn(const Json& object) {
  Wish wish;
  if (!at(object, "camera").is_null()) wish.camera = cameraIn(object["camera"]);
  if (!at(object, "resolution").is_null()) wish.resolution = resolutionIn(object["resolution"], 1);
  if (!at(object, "supersegments").is_null())
    wish.supersegments = wholeIn(object["supersegments"], "supersegments", 1, maxSupersegments);
  if (!at(object, "sampling_rate").is_null()) wish.samplingRate = samplingRateIn(object["sampling_rate"]);
  if (!at(object, "range").is_null()) wish.range = rangeIn(object["range"]);
  if (!at(object, "preset").is_null()) wish.preset = textIn(object["preset"], "preset");
  if (!at(object, "period").is_null()) wish.period = wholeIn(object["period"], "period", 1, maxPeriod);
  if (!at(object, "paused").is_null()) wish.paused = flagIn(object["paused"], "paused");
  const Json& parameters = at(object, "parameters");
  if (parameters.is_null()) return wish;
  if (!parameters.is_object() || parameters.size() > maxParameters)
    refuse(fmt::format("\"parameters\" isn't an object of at most {} entries", maxParameters));
  for (const auto& [name, value] : parameters.items())
    wish.parameters[nameIn(name)] = numberIn(value, "parameters");
  return wish;
}

Json jsonOf(const Controls& controls) {
  Json object{{"period", controls.period}, {"paused", controls.paused}, {"parameters", Json::array()}};
  for (const Parameter& parameter : controls.parameters) {
    object["parameters"].push_back({{"name", parameter.name},
                                    {"whole", parameter.isWhole},
                                    {"value", parameter.value},
                                    {"low", parameter.low},
                                    {"high", parameter.high}});
  }
  object["generator"] = nullptr;
  if (controls.generator) {
    const GeneratorControls& generator = *controls.generator;
    object["generator"] = {{"resolution", generator.resolution},
                           {"supersegments", generator.supersegments},
                           {"range", generator.range ? Json(*generator.range) : Json()},
                           {"presets", generator.presets}};
    if (generator.samplingRate) object["generator"]["sampling_rate"] = *generator.samplingRate;
  }
  return object;
}

Controls controlsIn(const Json& object) {
  Controls controls;
  controls.period = wholeIn(at(object, "period"), "period", 1, maxPeriod);
  controls.paused = flagIn(at(object, "paused"), "paused");
  for (const Json& parameter : arrayIn(at(object, "parameters"), "parameters", 0, maxParameters))
    controls.parameters.push_back(parameterIn(parameter));
  if (!at(object, "generator").is_null()) controls.generator = generatorIn(object["generator"]);
  return controls;
}

std::string textOf(const Wish& wish) {
  return jsonOf(wish).dump();
}

Wish wishOf(std::string_view text) {
  const nlohmann::json object = nlohmann::json::parse(text, nullptr, false);
  if (!object.is_object()) throw Error(ErrorCode::Format, "a wish isn't a JSON object");
  return wishIn(object);
}

std::string logEntryOf(const SteeringRequest& request, std::int64_t step, double time) {
  nlohmann::ordered_json entry{{"step", step}};
  entry["time"] = std::isfinite(time) ? nlohmann::ordered_json(time) : nlohmann::ordered_json();
  entry["viewer"] = request.viewer;
  entry["steer"] = jsonOf(request.wish);
  return entry.dump();
}

}  // namespace vdi::stream
