#include "vdi/io/Metadata.h"

#include <fmt/format.h>

#include <cstddef>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "vdi/core/Error.h"
#include "vdi/io/JsonFault.h"
#include "vdi/io/JsonText.h"

namespace vdi::io {

using nlohmann::json;

namespace {

[[noreturn]] void refuse(const std::string& what) {
  throw Error(ErrorCode::Format, "invalid metadata: " + what);
}

/// The field of an object; throws if it is missing.
const json& at(const json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end()) refuse(fmt::format("'{}' is missing", name));
  return *found;
}

const json& objectAt(const json& object, const char* name) {
  const json& value = at(object, name);
  if (!value.is_object()) refuse(fmt::format("'{}' is not an object", name));
  return value;
}

double numberAt(const json& object, const char* name) {
  const json& value = at(object, name);
  if (!value.is_number()) refuse(fmt::format("'{}' is not a number", name));
  return value.get<double>();
}

std::string textAt(const json& object, const char* name) {
  const json& value = at(object, name);
  if (!value.is_string()) refuse(fmt::format("'{}' is not a string", name));
  return value.get<std::string>();
}

int wholeNumberAt(const json& object, const char* name) {
  const json& value = at(object, name);
  constexpr std::int64_t most = std::numeric_limits<int>::max();
  if (!value.is_number_integer() || value.get<std::int64_t>() < -most || value.get<std::int64_t>() > most)
    refuse(fmt::format("'{}' is not a whole number", name));
  return value.get<int>();
}

/// Reads rows of `width` numbers.
std::vector<std::vector<double>> rowsAt(const json& object, const char* name, std::size_t width) {
  const json& value = at(object, name);
  std::vector<std::vector<double>> rows;
  const auto require = [&](bool good) {
    if (!good) refuse(fmt::format("'{}' is not a list of lists of {} numbers", name, width));
  };
  require(value.is_array());
  for (const json& row : value) {
    require(row.is_array() && row.size() == width);
    std::vector<double> numbers;
    for (const json& number : row) {
      require(number.is_number());
      numbers.push_back(number.get<double>());
    }
    rows.push_back(std::move(numbers));
  }
  return rows;
}

ScalarArray arrayIn(const json& object) {
  const std::string association = textAt(object, "association");
  if (association != "points" && association != "cells") refuse("'association' is neither points nor cells");
  return {.name = textAt(object, "name"),
          .cells = association == "cells",
          .components = wholeNumberAt(object, "components"),
          .component = wholeNumberAt(object, "component")};
}

TransferFunction functionIn(const json& object) {
  TransferFunction function;
  for (const std::vector<double>& row : rowsAt(object, "colors", 4))
    function.colors.push_back({row[0], {row[1], row[2], row[3]}});
  for (const std::vector<double>& row : rowsAt(object, "opacities", 2))
    function.opacities.push_back({row[0], row[1]});
  function.unitDistance = numberAt(object, "unitDistance");
  return function;
}

Coloring coloringOf(const json& object) {
  Coloring coloring{.array = arrayIn(objectAt(object, "array")),
                    .range = {},
                    .function = functionIn(objectAt(object, "transferFunction"))};
  if (object.contains("range")) {
    const json& range = object.at("range");
    if (!range.is_array() || range.size() != 2 || !range[0].is_number() || !range[1].is_number() ||
        range[0].get<double>() > range[1].get<double>())
      refuse("'range' isn't two ascending numbers");
    coloring.range = {range[0].get<double>(), range[1].get<double>()};
  }
  return coloring;
}

}  // namespace

std::string metadataText(const Coloring& coloring, double time, std::uint64_t timeStep) {
  validate(coloring);
  const auto& [array, range, function] = coloring;
  std::vector<std::string> colors;
  for (const ColorNode& node : function.colors) {
    colors.push_back(
        jsonListOf({jsonOf(node.x), jsonOf(node.color.r), jsonOf(node.color.g), jsonOf(node.color.b)}));
  }
  std::vector<std::string> opacities;
  for (const OpacityNode& node : function.opacities)
    opacities.push_back(jsonListOf({jsonOf(node.x), jsonOf(node.opacity)}));
  JsonObject object;
  object.add("array", JsonObject()
                          .add("association", jsonOf(array.cells ? "cells" : "points"))
                          .add("component", jsonOf(array.component))
                          .add("components", jsonOf(array.components))
                          .add("name", jsonOf(array.name))
                          .text());
  if (range.min <= range.max) object.add("range", jsonListOf({jsonOf(range.min), jsonOf(range.max)}));
  object.add("time", jsonOf(time)).add("timeStep", jsonOf(timeStep));
  object.add("transferFunction", JsonObject()
                                     .add("colors", jsonListOf(colors))
                                     .add("opacities", jsonListOf(opacities))
                                     .add("unitDistance", jsonOf(function.unitDistance))
                                     .text());
  std::string text = object.text();
  if (text.size() > maxMetadataBytes) refuse(fmt::format("they would take {} bytes", text.size()));
  return text;
}

Coloring coloringIn(std::string_view text) {
  if (text.size() > maxMetadataBytes) refuse(fmt::format("they take {} bytes", text.size()));
  try {
    const json object = json::parse(text.begin(), text.end());
    if (!object.is_object()) refuse("they are not a JSON object");
    Coloring coloring = coloringOf(object);
    validate(coloring);
    return coloring;
  } catch (const json::parse_error& error) {
    refuse("not valid JSON: " + jsonFault(text, error.byte, error.id));
  } catch (const json::exception& error) {  // a number that overflows
    refuse("not valid JSON: " + jsonFault(text, text.size(), error.id));
  }
}

}  // namespace vdi::io
