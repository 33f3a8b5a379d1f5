#include "vdi/stream/SteeringJson.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "vdi/core/Budget.h"
#include "vdi/core/Error.h"
#include "vdi/core/SettingsTable.h"

namespace vdi::stream {

namespace {

using io::jsonFlag;
using io::jsonListOf;
using io::JsonObject;
using io::jsonOf;
using io::JsonValue;

constexpr std::size_t maxPresets = 64;

int wholeIn(const JsonValue& value, int low, int high) {
  return static_cast<int>(value.whole(low, high));
}

std::string textIn(const JsonValue& value) {
  if (value.text().size() > maxNameBytes)
    value.fail(fmt::format("must be a string of at most {} bytes", maxNameBytes));
  return value.text();
}

std::vector<JsonValue> itemsIn(const JsonValue& value, std::size_t most) {
  std::vector<JsonValue> items = value.items();
  if (items.size() > most) value.fail(fmt::format("must be an array of at most {} entries", most));
  return items;
}

std::array<double, 2> rangeIn(const JsonValue& value) {
  const std::vector<double> ends = value.numbers(2);
  if (!(ends[0] < ends[1]) || !std::isfinite(ends[1] - ends[0])) value.fail("doesn't rise");
  return {ends[0], ends[1]};
}

std::array<int, 2> resolutionIn(const JsonValue& value, int least) {
  const std::vector<JsonValue> sides = value.items();
  if (sides.size() != 2) value.fail("must be an array of 2 whole numbers");
  return {wholeIn(sides[0], least, View::maxSide), wholeIn(sides[1], least, View::maxSide)};
}

glm::dvec3 vectorIn(const JsonValue& value) {
  const std::vector<double> numbers = value.numbers(3);
  return {numbers[0], numbers[1], numbers[2]};
}

Camera cameraIn(const JsonValue& value) {
  Camera camera;
  camera.position = vectorIn(value.at("position"));
  camera.focalPoint = vectorIn(value.at("focalPoint"));
  camera.viewUp = vectorIn(value.at("viewUp"));
  const std::optional<JsonValue> parallelScale = value.findUnlessNull("parallelScale");
  camera.parallelProjection = parallelScale.has_value();
  if (parallelScale) {
    camera.parallelScale = parallelScale->number();
  } else {
    camera.viewAngle = value.at("viewAngle").number();
  }
  try {
    (void)View(camera, 1, 1);
  } catch (const Error& error) {
    value.fail(error.what());
  }
  return camera;
}

std::string jsonOf(const glm::dvec3& vector) {
  return jsonListOf({jsonOf(vector.x), jsonOf(vector.y), jsonOf(vector.z)});
}

template <typename Number>
std::string pairOf(const std::array<Number, 2>& pair) {
  return jsonListOf({jsonOf(pair[0]), jsonOf(pair[1])});
}

std::string jsonOf(const Camera& camera) {
  JsonObject object;
  object.add("position", jsonOf(camera.position));
  object.add("focalPoint", jsonOf(camera.focalPoint));
  object.add("viewUp", jsonOf(camera.viewUp));
  if (camera.parallelProjection) {
    object.add("parallelScale", jsonOf(camera.parallelScale));
  } else {
    object.add("viewAngle", jsonOf(camera.viewAngle));
  }
  return object.text();
}

std::string nameIn(const std::string& name) {
  if (!isParameterName(name)) refuse("a parameter's name may only contain letters, digits, '_', '-' and '.'");
  return name;
}

Parameter parameterIn(const JsonValue& value) {
  Parameter parameter;
  parameter.name = nameIn(textIn(value.at("name")));
  parameter.isWhole = value.at("whole").flag();
  parameter.value = value.at("value").number();
  parameter.low = value.at("low").number();
  parameter.high = value.at("high").number();
  if (!(parameter.low <= parameter.value && parameter.value <= parameter.high))
    value.fail("is out of its bounds");
  return parameter;
}

double samplingRateIn(const JsonValue& value) {
  const double rate = value.number();
  try {
    settingsTable()[indexOfSetting("SamplingRate")].check(rate);
  } catch (const Error& error) {
    value.fail(error.what());
  }
  return rate;
}

GeneratorControls generatorIn(const JsonValue& value) {
  GeneratorControls controls;
  controls.resolution = resolutionIn(value.at("resolution"), 0);
  controls.supersegments = wholeIn(value.at("supersegments"), 0, maxSupersegments);
  if (const auto range = value.findUnlessNull("range")) controls.range = rangeIn(*range);
  for (const JsonValue& preset : itemsIn(value.at("presets"), maxPresets))
    controls.presets.push_back(textIn(preset));
  if (const auto preset = value.findUnlessNull("preset")) controls.preset = textIn(*preset);
  if (const auto rate = value.findUnlessNull("sampling_rate")) controls.samplingRate = samplingRateIn(*rate);
  return controls;
}

std::string jsonOf(const Parameter& parameter) {
  JsonObject object;
  object.add("name", jsonOf(parameter.name)).add("whole", jsonFlag(parameter.isWhole));
  object.add("value", jsonOf(parameter.value));
  object.add("low", jsonOf(parameter.low)).add("high", jsonOf(parameter.high));
  return object.text();
}

std::string jsonOf(const GeneratorControls& controls) {
  std::vector<std::string> presets;
  presets.reserve(controls.presets.size());
  for (const std::string& preset : controls.presets) presets.push_back(jsonOf(preset));
  JsonObject object;
  object.add("resolution", pairOf(controls.resolution));
  object.add("supersegments", jsonOf(controls.supersegments));
  object.add("range", controls.range ? pairOf(*controls.range) : "null");
  object.add("presets", jsonListOf(presets));
  if (controls.preset) object.add("preset", jsonOf(*controls.preset));
  if (controls.samplingRate) object.add("sampling_rate", jsonOf(*controls.samplingRate));
  return object.text();
}

}  // namespace

void refuse(const std::string& what) {
  throw Error(ErrorCode::Format, what);
}

void addWish(JsonObject& object, const Wish& wish) {
  if (wish.camera) object.add("camera", jsonOf(*wish.camera));
  if (wish.resolution) object.add("resolution", pairOf(*wish.resolution));
  if (wish.supersegments) object.add("supersegments", jsonOf(*wish.supersegments));
  if (wish.samplingRate) object.add("sampling_rate", jsonOf(*wish.samplingRate));
  if (wish.range) object.add("range", pairOf(*wish.range));
  if (wish.preset) object.add("preset", jsonOf(*wish.preset));
  if (wish.period) object.add("period", jsonOf(*wish.period));
  if (wish.paused) object.add("paused", jsonFlag(*wish.paused));
  if (wish.parameters.empty()) return;
  JsonObject parameters;
  for (const auto& [name, value] : wish.parameters) parameters.add(name, jsonOf(value));
  object.add("parameters", parameters.text());
}

Wish wishIn(const JsonValue& object) {
  Wish wish;
  const auto ifSet = [&](const char* name, auto read) {
    if (const std::optional<JsonValue> value = object.findUnlessNull(name)) read(*value);
  };
  ifSet("camera", [&](const JsonValue& value) { wish.camera = cameraIn(value); });
  ifSet("resolution", [&](const JsonValue& value) { wish.resolution = resolutionIn(value, 1); });
  ifSet("supersegments",
        [&](const JsonValue& value) { wish.supersegments = wholeIn(value, 1, maxSupersegments); });
  ifSet("sampling_rate", [&](const JsonValue& value) { wish.samplingRate = samplingRateIn(value); });
  ifSet("range", [&](const JsonValue& value) { wish.range = rangeIn(value); });
  ifSet("preset", [&](const JsonValue& value) { wish.preset = textIn(value); });
  ifSet("period", [&](const JsonValue& value) { wish.period = wholeIn(value, 1, maxPeriod); });
  ifSet("paused", [&](const JsonValue& value) { wish.paused = value.flag(); });
  ifSet("parameters", [&](const JsonValue& value) {
    const auto members = value.members();
    if (members.size() > maxParameters)
      value.fail(fmt::format("must be an object of at most {} fields", maxParameters));
    for (const auto& [name, number] : members) wish.parameters[nameIn(name)] = number.number();
  });
  return wish;
}

void addControls(JsonObject& object, const Controls& controls) {
  std::vector<std::string> parameters;
  parameters.reserve(controls.parameters.size());
  for (const Parameter& parameter : controls.parameters) parameters.push_back(jsonOf(parameter));
  object.add("period", jsonOf(controls.period)).add("paused", jsonFlag(controls.paused));
  object.add("parameters", jsonListOf(parameters));
  object.add("generator", controls.generator ? jsonOf(*controls.generator) : "null");
}

Controls controlsIn(const JsonValue& object) {
  Controls controls;
  controls.period = wholeIn(object.at("period"), 1, maxPeriod);
  controls.paused = object.at("paused").flag();
  for (const JsonValue& parameter : itemsIn(object.at("parameters"), maxParameters))
    controls.parameters.push_back(parameterIn(parameter));
  if (const auto generator = object.findUnlessNull("generator")) controls.generator = generatorIn(*generator);
  return controls;
}

std::string textOf(const Wish& wish) {
  JsonObject object;
  addWish(object, wish);
  return object.text();
}

Wish wishOf(std::string_view text) {
  return wishIn(io::parseJson(text, "a wish"));
}

std::string logEntryOf(const SteeringRequest& request, std::int64_t step, double time) {
  JsonObject entry;
  entry.add("step", jsonOf(step)).add("time", jsonOf(time)).add("viewer", jsonOf(request.viewer));
  entry.add("steer", textOf(request.wish));
  return entry.text();
}

}  // namespace vdi::stream
