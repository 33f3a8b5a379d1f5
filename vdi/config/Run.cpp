#include "vdi/config/Run.h"

#include <fmt/format.h>

#include <cmath>
#include <system_error>

#include "vdi/config/Presets.h"
#include "vdi/core/Error.h"
#include "vdi/io/Json.h"

namespace vdi::config {

using io::readJsonText;

namespace {

constexpr const char* defaultPreset = "Cool to Warm";

}  // namespace

Orbit Run::orbitAt(const RunOrbit& orbit, std::int64_t step, double time) const {
  constexpr double full = 360.0;
  const std::int64_t counted = every > 0 ? step / every : 0;
  double frame = static_cast<double>(counted);
  if (every == 0 && everyTime) frame = periodsIn(time, *everyTime);
  Orbit place = orbit.start;
  const double turned = orbit.turn * frame;
  if (std::isfinite(turned)) place.azimuth = std::fmod(place.azimuth + turned, full);
  return place;
}

Camera Run::cameraAt(const RunCamera& camera, std::int64_t step, double time, const Box& bounds) const {
  if (camera.fixed) return *camera.fixed;
  if (camera.orbit) return orbitCamera(bounds, orbitAt(*camera.orbit, step, time), camera.orbit->viewAngle);
  const Camera along;
  return Camera::framing(bounds, {0.0, 0.0, -1.0}, along.viewUp, along.viewAngle);
}

GenerateSettings Run::settingsOf(const RunField& field) const {
  GenerateSettings own = settings;
  own.interpolation = field.interpolation;
  return own;
}

TransferFunction RunColors::transferFunction(const ScalarRange& first, double firstUnitDistance) const {
  ScalarRange wide = range.value_or(first);
  if (!(wide.min <= wide.max)) wide = {0.0, 1.0};
  if (wide.min == wide.max) wide.max += 1.0;
  TransferFunction function;
  if (!map && !preset.empty() && preset != defaultPreset) {
    function = presetTransferFunction(preset, wide, 1.0);
  } else {
    const ColorMap scaled = rescaled(map ? *map : coolToWarm(), wide);
    function.colors = scaled.colors;
    function.opacities = scaled.opacities;
    if (function.opacities.empty()) function.opacities = {{wide.min, 0.0}, {wide.max, 1.0}};
  }
  if (!opacities.empty()) function.opacities = opacities;
  function.unitDistance = unitDistance.value_or(firstUnitDistance);
  return function;
}

std::optional<std::filesystem::path> Run::firstExisting() const {
  std::vector<FilePattern> patterns;
  if (vdi) patterns.push_back(*vdi);
  if (png) patterns.push_back(*png);
  if (cinema) patterns.push_back(cinema->pictures);
  for (const FilePattern& pattern : patterns) {
    for (const RunField& field : fields) {
      for (const RunCamera& one : cameras) {
        std::optional<std::filesystem::path> file = pattern.firstExisting(one.name, field.name);
        if (file) return file;
      }
    }
  }
  std::error_code error;
  if (cinema && std::filesystem::exists(cinema->index(), error)) return cinema->index();
  for (const std::string& name : {log.json, log.text}) {
    // If it isn't a regular file, the log reports the mistake.
    if (!name.empty() && std::filesystem::is_regular_file(name, error) &&
        std::filesystem::file_size(name, error) > 0 && !error)
      return name;
  }
  return std::nullopt;
}

void requireNothingInTheWay(const Run& run) {
  if (run.existing != Existing::Refuse) return;
  const std::optional<std::filesystem::path> file = run.firstExisting();
  if (!file) return;
  throw Error(
      ErrorCode::Io,
      "a file of another run is in the way; \"existing\": \"continue\" continues that run after a restart, "
      "\"existing\": \"overwrite\" starts over",
      file->string());
}

double periodsIn(double time, double period) {
  constexpr double early = 1e-6;
  return std::floor(time / period + early);
}

std::vector<std::string> presetNames() {
  std::vector<std::string> names{defaultPreset};
  for (const PresetInfo& info : transferFunctionPresets()) names.push_back(info.name);
  return names;
}

RunText readRun(const std::string& fileOrText) {
  const std::size_t first = fileOrText.find_first_not_of(" \t\r\n");
  if (first != std::string::npos && fileOrText[first] == '{') return {fileOrText, "the JSON text", {}};
  return {readJsonText(fileOrText), fileOrText, std::filesystem::path(fileOrText).parent_path()};
}

std::string readColorsFile(const RunColors& colors, const RunText& source) {
  return readJsonText((source.folder / colors.file).string(), presetLimits);
}

}  // namespace vdi::config
