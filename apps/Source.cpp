#include "apps/Source.h"

#include <fmt/format.h>
#include <fmt/ranges.h>  // fmt::join
#include <CLI/CLI.hpp>

#include <algorithm>
#include <charconv>

#include "apps/Help.h"
#include "apps/RawVolume.h"
#include "apps/TransferFunctions.h"
#include "vdi/config/Presets.h"
#include "vdi/core/ComponentValues.h"
#include "vdi/core/Error.h"
#include "vdi/core/SettingsTable.h"
#include "vdi/synthetic/DeviceField.h"
#include "vdi/synthetic/Fields.h"

namespace vdi::apps {

namespace {

synthetic::Joint jointOf(const std::string& name) {
  if (name == "shared") return synthetic::Joint::SharedPoints;
  if (name == "gap") return synthetic::Joint::Gap;
  if (name == "cells") return synthetic::Joint::Cells;
  throw Error(ErrorCode::InvalidArgument, "unknown joint '" + name + "'; use shared, gap or cells");
}

template <typename T>
glm::vec<3, T> vectorOf(const std::vector<T>& v) {
  return {v[0], v[1], v[2]};
}

/// The value that represents a field's 1: near the greatest value of an integer type, 1 for
/// floating point.
double topOf(ScalarType type) {
  switch (type) {
    case ScalarType::U8:
      return 255.0;
    case ScalarType::I8:
      return 127.0;
    case ScalarType::U16:
      return 65535.0;
    case ScalarType::I16:
      return 32767.0;
    case ScalarType::U32:
    case ScalarType::I32:
      return 1e9;
    case ScalarType::F32:
    case ScalarType::F64:
      break;
  }
  return 1.0;
}

const char* const decompositionGroup = "Volume and ranks";
const char* const viewGroup = "Viewpoint";
const char* const qualityGroup = "VDI";

}  // namespace

std::vector<int> parseSizes(const std::string& text, std::size_t count) {
  std::vector<int> sizes;
  const char* at = text.data();
  const char* const end = text.data() + text.size();
  while (sizes.size() < count) {
    int value = 0;
    const auto [after, error] = std::from_chars(at, end, value);
    if (error != std::errc() || value < 1) break;
    sizes.push_back(value);
    at = after;
    if (sizes.size() == count || at == end || *at != 'x') break;
    ++at;
  }
  if (sizes.size() != count || at != end) {
    throw Error(ErrorCode::InvalidArgument,
                "'" + text + "' must be " + std::to_string(count) + " positive whole numbers joined by x");
  }
  return sizes;
}

std::filesystem::path withSuffix(const std::filesystem::path& path, const std::string& suffix) {
  return path.parent_path() / (path.stem().string() + "_" + suffix + path.extension().string());
}

std::string fieldsHelp() {
  std::string text;
  for (const synthetic::FieldInfo& info : synthetic::fields())
    text += "\n  " + info.name + ": " + info.description;
  return text;
}

void addDecompositionOptions(CLI::App& command, DecompositionOptions& options) {
  command.add_option("--size", options.size, "values per axis of a field")
      ->type_name("XxYxZ")
      ->capture_default_str()
      ->group(decompositionGroup);
  command
      .add_option("--copies", options.copies,
                  "copies of a field along each axis, each of --size values and --blocks blocks. They share "
                  "memory, so the volume may be larger than the host's memory. Requires cell data")
      ->type_name("XxYxZ")
      ->capture_default_str()
      ->group(decompositionGroup);
  command.add_option("--type", options.type, "scalar type of a field: u8, i8, u16, i16, u32, i32, f32, f64")
      ->type_name("TYPE")
      ->capture_default_str()
      ->group(decompositionGroup);
  command.add_option("--seed", options.seed, "seed of random fields and layouts")
      ->capture_default_str()
      ->group(decompositionGroup);
  command.add_option("--blocks", options.blocks, "blocks per axis")
      ->type_name("XxYxZ")
      ->capture_default_str()
      ->group(decompositionGroup);
  command
      .add_option(
          "--layout", options.layout,
          fmt::format(
              "assignment of blocks to ranks: {}; with fewer blocks than ranks, some ranks hold nothing",
              fmt::join(synthetic::layoutNames(), ", ")))
      ->type_name("LAYOUT")
      ->capture_default_str()
      ->group(decompositionGroup);
  command
      .add_option("--joint", options.joint,
                  "shared: neighbouring blocks both hold the points of their common face; gap: no point is "
                  "held twice; cells: cell data; default: shared, or the raw volume's")
      ->type_name("JOINT")
      ->group(decompositionGroup);
  command
      .add_option("--missing", options.missing,
                  "numbers that stand for missing values, such as -9999; these are transparent and don't "
                  "count in ranges")
      ->expected(1, -1)
      ->type_name("X")
      ->group(decompositionGroup);
}

std::vector<Block> rawBlocks(const std::string& sidecar, const DecompositionOptions& options, int rank,
                             int ranks) {
  RawVolume volume = readSidecar(sidecar);
  if (!options.joint.empty()) {
    const synthetic::Joint joint = jointOf(options.joint);
    if ((joint == synthetic::Joint::Cells) != (volume.lattice.joint == synthetic::Joint::Cells)) {
      throw Error(ErrorCode::InvalidArgument,
                  "--joint " + options.joint + " contradicts the association of " + sidecar);
    }
    volume.lattice.joint = joint;
  }
  volume.missing.insert(volume.missing.end(), options.missing.begin(), options.missing.end());
  std::vector<Block> blocks;
  for (const synthetic::Part& part : synthetic::decompose(
           volume.lattice.size, vectorOf(parseSizes(options.blocks, 3)),
           synthetic::layoutFromString(options.layout), volume.lattice.joint, ranks, options.seed)) {
    if (part.owner == rank) blocks.push_back(readPart(volume, part));
  }
  return blocks;
}

ScalarArray rawArray(const std::string& sidecar) {
  ScalarArray array;
  array.name = std::filesystem::path(sidecar).stem().string();
  array.cells = readSidecar(sidecar).lattice.joint == synthetic::Joint::Cells;
  return array;
}

ScalarArray fieldArray(const std::string& field, const DecompositionOptions& options) {
  ScalarArray array;
  array.name = field;
  const bool hasCopies = vectorOf(parseSizes(options.copies, 3)) != glm::ivec3(1);
  array.cells = options.joint.empty() ? hasCopies : jointOf(options.joint) == synthetic::Joint::Cells;
  return array;
}

namespace {

/// The longest axis has length 1.
glm::dvec3 spacingOf(const synthetic::Lattice& lattice) {
  const int longest = std::max({lattice.size.x, lattice.size.y, lattice.size.z});
  return glm::dvec3(1.0 / std::max(lattice.joint == synthetic::Joint::Cells ? longest : longest - 1, 1));
}

}  // namespace

std::vector<Block> fieldBlocks(const std::string& name, const DecompositionOptions& options,
                               const std::shared_ptr<gpu::Device>& device, int rank, int ranks) {
  synthetic::Lattice lattice;
  lattice.size = vectorOf(parseSizes(options.size, 3));
  lattice.type = scalarTypeFromString(options.type);
  if (!options.joint.empty()) lattice.joint = jointOf(options.joint);
  const glm::ivec3 copies = vectorOf(parseSizes(options.copies, 3));
  if (copies != glm::ivec3(1)) {
    if (options.joint.empty()) lattice.joint = synthetic::Joint::Cells;
    if (lattice.joint != synthetic::Joint::Cells)
      throw Error(ErrorCode::InvalidArgument, "copies require cell data, --joint cells", "--copies");
  }
  lattice.spacing = spacingOf(lattice);
  synthetic::Lattice all = lattice;
  all.size = lattice.size * copies;
  all.spacing = spacingOf(all);
  std::vector<synthetic::Part> parts =
      synthetic::decompose(all.size, vectorOf(parseSizes(options.blocks, 3)) * copies,
                           synthetic::layoutFromString(options.layout), lattice.joint, ranks, options.seed);
  std::erase_if(parts, [rank](const synthetic::Part& part) { return part.owner != rank; });
  std::vector<Block> blocks =
      synthetic::DeviceField(device, name, options.seed).makeBlocks(lattice, all, parts, topOf(lattice.type));
  for (Block& block : blocks) leaveOutMissing(block, options.missing);
  return blocks;
}

void addCameraOptions(CLI::App& command, CameraOptions& options, const std::string& otherwise) {
  command
      .add_option("--camera", options.file,
                  "JSON file of the camera (docs/raw-volumes.md); default: " + otherwise)
      ->check(requireFileName)
      ->type_name("FILE")
      ->group(viewGroup);
  const auto addVector = [&](const char* name, std::vector<double>& value, const char* description) {
    return command.add_option(name, value, description)->expected(3)->type_name("X Y Z")->group(viewGroup);
  };
  addVector("--position", options.position, "the camera's position in world space");
  addVector("--focal-point", options.focalPoint, "the point that the camera looks at, in world space");
  addVector("--view-up", options.viewUp, "the direction that is up in the picture");
  CLI::Option* angle = command
                           .add_option("--view-angle", options.viewAngle,
                                       "vertical angle in degrees, for perspective projection")
                           ->group(viewGroup);
  command
      .add_option("--parallel-scale", options.parallelScale,
                  "half the picture's height in world units, for parallel projection")
      ->excludes(angle)
      ->group(viewGroup);
}

Camera chosenCamera(const CameraOptions& options, const Camera& otherwise) {
  Camera camera = options.file.empty() ? otherwise : readCamera(options.file);
  if (!options.position.empty()) camera.position = vectorOf(options.position);
  if (!options.focalPoint.empty()) camera.focalPoint = vectorOf(options.focalPoint);
  if (!options.viewUp.empty()) camera.viewUp = vectorOf(options.viewUp);
  if (options.viewAngle) {
    camera.parallelProjection = false;
    camera.viewAngle = *options.viewAngle;
  }
  if (options.parallelScale) {
    camera.parallelProjection = true;
    camera.parallelScale = *options.parallelScale;
  }
  return camera;
}

void addViewOptions(CLI::App& command, ViewOptions& options) {
  addCameraOptions(command, options.camera, "on an orbit that shows the whole scene");
  const auto orbit = [&](CLI::Option* option) {
    option->excludes("--camera")->excludes("--position")->group(viewGroup);
    return option;
  };
  orbit(command
            .add_option("--azimuth", options.orbit.azimuth,
                        "degrees around the scene's centre, about --view-up")
            ->capture_default_str());
  orbit(command.add_option("--elevation", options.orbit.elevation, "degrees above the centre")
            ->capture_default_str());
  orbit(command.add_option("--zoom", options.orbit.zoom, "magnification; values above 1 move closer")
            ->check(requirePositive)
            ->capture_default_str());
  orbit(command.add_flag("--parallel", options.parallel, "parallel projection of the whole scene"))
      ->excludes("--view-angle");
}

Camera makeCamera(const ViewOptions& options, const Scene& scene) {
  // The distance that shows the whole scene depends on these; invalid values are rejected later.
  const double angle = options.camera.viewAngle.value_or(30.0);
  const bool sensible = angle > 0.0 && angle < 180.0;
  config::Orbit orbit = options.orbit;
  if (!options.camera.viewUp.empty()) {
    orbit.up = vectorOf(options.camera.viewUp);
    if (!(glm::length(orbit.up) > 0.0))
      throw Error(ErrorCode::InvalidArgument, "--view-up must be finite and not zero");
  }
  Camera camera = config::orbitCamera(scene.bounds, orbit, sensible ? angle : 30.0);
  camera.parallelProjection = options.parallel;
  return chosenCamera(options.camera, camera);
}

namespace {

/// Options for all settings of the table, except those that `use` leaves to the command.
void addSettingsOptions(CLI::App& command, GenerateSettings& settings, QualityUse use) {
  const std::vector<std::string> several{"Supersegments", "Algorithm"};
  for (const Setting& setting : settingsTable()) {
    if (use == QualityUse::Several && std::ranges::count(several, setting.property) > 0) continue;
    const std::string name = optionOf(setting);
    const auto put = [&settings, &setting](double value) { setting.set(settings, value); };
    CLI::Option* option = nullptr;
    if (setting.kind == Setting::Kind::Flag) {
      option = command.add_flag_callback(
          name, [put] { put(1.0); }, setting.help);
    } else if (setting.kind == Setting::Kind::Name) {
      const auto putName = [put, &setting](const std::string& value) { put(setting.named(value)); };
      option = command.add_option_function<std::string>(name, putName, setting.help)->type_name("NAME");
    } else {
      option = command.add_option_function<double>(name, put, setting.help);
      if (setting.kind == Setting::Kind::Count) option->type_name("UINT");
    }
    if (setting.kind != Setting::Kind::Flag) option->default_str(setting.text(setting.get(settings)));
    option->group(qualityGroup);
  }
}

void addLightsOption(CLI::App& command, QualityOptions& options) {
  command
      .add_option("--lights", options.lights,
                  "with --shade: kit, ParaView's five lights; headlight, a light along each ray")
      ->check(CLI::IsMember({"kit", "headlight"}))
      ->type_name("NAME")
      ->capture_default_str()
      ->group(qualityGroup);
}

void addRegionOptions(CLI::App& command, QualityOptions& options) {
  command
      .add_option("--crop", options.crop,
                  "show only the inside of a box in world coordinates: lowest and highest x, y and z")
      ->expected(6)
      ->type_name("X")
      ->group(qualityGroup);
  addClipOption(command, options.clip, qualityGroup);
}

void addBlendingOptions(CLI::App& command, QualityOptions& options) {
  command
      .add_option("--blend", options.blend,
                  "rule that turns a ray's scalars into a pixel: composite; maximum or minimum, with that "
                  "scalar's colour and opacity; isosurface, with those of each isovalue on the ray. A VDI "
                  "holds only composite")
      ->type_name("NAME")
      ->capture_default_str()
      ->group(qualityGroup);
  command
      .add_option("--isovalues", options.isovalues,
                  "with --blend isosurface: the scalars to show, up to " + std::to_string(maxIsovalues))
      ->expected(1, static_cast<int>(maxIsovalues))
      ->type_name("X")
      ->group(qualityGroup);
}

Region makeRegion(const QualityOptions& options) {
  Region region;
  const std::vector<double>& b = options.crop;
  if (!b.empty()) region.box = {{b[0], b[2], b[4]}, {b[1], b[3], b[5]}};
  region.planes = makeClipPlanes(options.clip);
  return region;
}

}  // namespace

void addClipOption(CLI::App& command, std::vector<double>& numbers, const char* group) {
  command
      .add_option("--clip", numbers,
                  "show only the side of a plane to which its normal points: a point and the normal, for "
                  "up to six planes")
      ->type_size(6)
      ->expected(1, static_cast<int>(maxClipPlanes))
      ->type_name("X Y Z NX NY NZ")
      ->group(group);
}

std::vector<ClipPlane> makeClipPlanes(const std::vector<double>& numbers) {
  std::vector<ClipPlane> planes;
  for (std::size_t i = 0; i + 6 <= numbers.size(); i += 6) {
    const double* p = numbers.data() + i;
    planes.push_back({{p[0], p[1], p[2]}, {p[3], p[4], p[5]}});
  }
  return planes;
}

namespace {

void addTransferFunctionOptions(CLI::App& command, QualityOptions& options) {
  std::string presets;
  for (const config::PresetInfo& info : config::transferFunctionPresets())
    presets += "\n  " + info.name + ": " + info.description;
  command
      .add_option("--transfer-function", options.transferFunction,
                  "a JSON file, whose name ends in .json (docs/raw-volumes.md), or one of these, stretched "
                  "over the data's range:" +
                      presets)
      ->type_name("NAME|FILE")
      ->capture_default_str()
      ->group(qualityGroup);
  command
      .add_option(
          "--unit-distance", options.unitDistance,
          "length in world units over which material has the transfer function's opacity; default: the "
          "file's, or a fiftieth of the scene's diagonal")
      ->check(requirePositive)
      ->group(qualityGroup);
}

}  // namespace

void addQualityOptions(CLI::App& command, QualityOptions& options, QualityUse use) {
  command.add_option("--resolution", options.resolution, "number of lists, which are pixels")
      ->type_name("WxH")
      ->capture_default_str()
      ->group(qualityGroup);
  addSettingsOptions(command, options.settings, use);
  addLightsOption(command, options);
  addRegionOptions(command, options);
  if (use == QualityUse::One) addBlendingOptions(command, options);
  addTransferFunctionOptions(command, options);
}

void addReconstructionOption(CLI::App& command, std::string& name) {
  command
      .add_option(
          "--reconstruction", name,
          "reconstruction between lists: sheared, in which faces lean as neighbouring lists suggest; smooth, "
          "which blends two lists; constant, as in the paper. Sheared is the most accurate, constant the "
          "fastest on a CPU")
      ->type_name("NAME")
      ->capture_default_str();
}

GenerateSettings makeSettings(const QualityOptions& options) {
  GenerateSettings settings = options.settings;
  const std::vector<int> sizes = parseSizes(options.resolution, 2);
  settings.width = sizes[0];
  settings.height = sizes[1];
  if (options.lights == "headlight") settings.shading.lights = {Light{}};
  settings.region = makeRegion(options);
  settings.blending = {blendModeFromString(options.blend), options.isovalues};
  validate(settings);
  return settings;
}

TransferFunction makeTransferFunction(const QualityOptions& options, const Scene& scene,
                                      const ScalarRange& range) {
  TransferFunction function;
  if (options.transferFunction.ends_with(".json")) {
    function = readTransferFunction(options.transferFunction, range);
  } else {
    const double diagonal = glm::length(scene.bounds.size());
    function = config::presetTransferFunction(options.transferFunction, range,
                                              diagonal > 0.0 ? diagonal / 50.0 : 1.0);
  }
  if (options.unitDistance) function.unitDistance = *options.unitDistance;
  return function;
}

}  // namespace vdi::apps
