#include "apps/Source.h"

#include <charconv>
#include <cmath>
#include <numbers>
#include <sstream>

#include "apps/Fields.h"
#include "apps/RawVolume.h"
#include "vdi/core/Error.h"

namespace vdi::apps {

namespace {

Joint jointOf(const std::string& name) {
  if (name == "shared") return Joint::SharedPoints;
  if (name == "gap") return Joint::Gap;
  if (name == "cells") return Joint::Cells;
  throw Error(ErrorCode::InvalidArgument, "no joint '" + name + "'; there are shared, gap and cells");
}

glm::ivec3 vectorOf(const std::vector<int>& v) {
  return {v[0], v[1], v[2]};
}

/// What a field's [0, 1] is stretched to: most of an integer type's positive range, 1 for floating point.
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

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace

std::vector<int> parseSizes(const std::string& text, std::size_t count) {
  std::vector<int> sizes;
  std::stringstream stream(text);
  for (std::string part; std::getline(stream, part, 'x');) {
    int value = 0;
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
    if (error != std::errc() || end != part.data() + part.size() || value < 1) break;
    sizes.push_back(value);
  }
  if (sizes.size() != count || !stream.eof()) {
    throw Error(ErrorCode::InvalidArgument,
                "'" + text + "' isn't " + std::to_string(count) + " positive numbers joined by x");
  }
  return sizes;
}

void addSourceOptions(CLI::App& command, SourceOptions& options) {
  std::string names;
  for (const FieldInfo& info : fields()) names += "\n  " + info.name + ": " + info.description;
  command.add_option("--raw", options.raw, "JSON sidecar of a raw volume (docs/raw-volumes.md)");
  command.add_option("--field", options.field, "procedural field:" + names)
      ->capture_default_str()
      ->excludes("--raw");
  command.add_option("--size", options.size, "values per axis of the field")->capture_default_str();
  command.add_option("--type", options.type, "scalar type of the field: u8 i8 u16 i16 u32 i32 f32 f64")
      ->capture_default_str();
  command.add_option("--seed", options.seed, "of random fields and layouts")->capture_default_str();
  command.add_option("--blocks", options.blocks, "blocks per axis")->capture_default_str();
  command.add_option("--layout", options.layout, "who holds which block: " + joined(layoutNames()))
      ->capture_default_str();
  command
      .add_option(
          "--joint", options.joint,
          "blocks share the points of common faces (shared), no point twice (gap), or cell data (cells)")
      ->capture_default_str();
}

std::vector<Block> makeBlocks(const SourceOptions& options, int rank, int ranks) {
  const glm::ivec3 count = vectorOf(parseSizes(options.blocks, 3));
  const Layout layout = layoutFromString(options.layout);
  std::vector<Block> blocks;
  if (!options.raw.empty()) {
    const RawVolume volume = readSidecar(options.raw);
    for (const Part& part :
         decompose(volume.lattice.size, count, layout, volume.lattice.joint, ranks, options.seed)) {
      if (part.owner == rank) blocks.push_back(readPart(volume, part));
    }
    return blocks;
  }
  Lattice lattice;
  lattice.size = vectorOf(parseSizes(options.size, 3));
  lattice.type = scalarTypeFromString(options.type);
  lattice.joint = jointOf(options.joint);
  const int longest = std::max({lattice.size.x, lattice.size.y, lattice.size.z});
  const bool cells = lattice.joint == Joint::Cells;
  const double spacing = 1.0 / std::max(cells ? longest : longest - 1, 1);
  lattice.spacing = glm::dvec3(spacing);
  const Field field = makeField(options.field, options.seed);
  const double top = topOf(lattice.type);
  for (const Part& part : decompose(lattice.size, count, layout, lattice.joint, ranks, options.seed)) {
    if (part.owner != rank) continue;
    blocks.push_back(makeBlock(lattice, part, [&](const glm::ivec3& index) {
      return top * field((glm::dvec3(index) + (cells ? 0.5 : 0.0)) * spacing);
    }));
  }
  return blocks;
}

void addViewOptions(CLI::App& command, ViewOptions& options) {
  command.add_option("--camera", options.camera,
                     "JSON file with position, focal_point, view_up and view_angle or parallel_scale");
  command.add_option("--azimuth", options.azimuth, "degrees around the scene, without --camera")
      ->capture_default_str();
  command.add_option("--elevation", options.elevation, "degrees above it, without --camera")
      ->capture_default_str();
  command.add_flag("--parallel", options.parallel, "parallel projection, without --camera");
}

Camera makeCamera(const ViewOptions& options, const Scene& scene) {
  if (!options.camera.empty()) return readCamera(options.camera);
  const double azimuth = options.azimuth * std::numbers::pi / 180.0;
  const double elevation = options.elevation * std::numbers::pi / 180.0;
  const glm::dvec3 towards{-std::sin(azimuth) * std::cos(elevation), -std::sin(elevation),
                           -std::cos(azimuth) * std::cos(elevation)};
  Camera camera = Camera::framing(scene.bounds, towards, {0.0, 1.0, 0.0});
  camera.parallelProjection = options.parallel;
  return camera;
}

void addQualityOptions(CLI::App& command, QualityOptions& options) {
  command.add_option("--resolution", options.resolution, "lists, that is pixels: WIDTHxHEIGHT")
      ->capture_default_str();
  command.add_option("--supersegments", options.supersegments, "the most in one list (N_S)")
      ->capture_default_str();
  command.add_option("--sampling-rate", options.samplesPerVoxel, "samples per voxel")->capture_default_str();
  command.add_option("--algorithm", options.algorithm, "how samples become supersegments: bisection")
      ->capture_default_str();
}

GenerateSettings makeSettings(const QualityOptions& options) {
  GenerateSettings settings;
  const std::vector<int> sizes = parseSizes(options.resolution, 2);
  settings.width = sizes[0];
  settings.height = sizes[1];
  settings.supersegments = options.supersegments;
  settings.samplesPerVoxel = options.samplesPerVoxel;
  settings.algorithm = algorithmFromString(options.algorithm);
  validate(settings);
  return settings;
}

TransferFunction makeTransferFunction(const std::string& file, const Scene& scene, const ScalarRange& range) {
  if (!file.empty()) return readTransferFunction(file);
  const double diagonal = scene.bounds.empty() ? 1.0 : glm::length(scene.bounds.size());
  const bool spread = range.min < range.max;
  const double min = range.min <= range.max ? range.min : 0.0;
  return defaultTransferFunction(min, spread ? range.max : min + 1.0, diagonal / 50.0);
}

}  // namespace vdi::apps
