#include "apps/RawVolume.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>

#include "vdi/core/Error.h"

namespace vdi::apps {

namespace {

using nlohmann::json;

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& what) {
  throw Error(ErrorCode::Format, what, path.string());
}

json readJson(const std::filesystem::path& path, const std::set<std::string>& known) {
  std::ifstream file(path);
  if (!file) throw Error(ErrorCode::Io, "can't open the file", path.string());
  const json document = json::parse(file, nullptr, false);
  if (!document.is_object()) fail(path, "not a JSON object");
  for (const auto& [key, value] : document.items()) {
    if (!known.contains(key)) fail(path, "unknown field '" + key + "'");
  }
  return document;
}

/// The field as T; throws with the field's name when it's missing or of another kind.
template <typename T>
T field(const json& document, const char* name, const std::filesystem::path& path) {
  if (!document.contains(name)) fail(path, std::string("the field '") + name + "' is missing");
  try {
    return document.at(name).get<T>();
  } catch (const json::exception&) {
    fail(path, std::string("the field '") + name + "' is of the wrong kind");
  }
}

template <typename T>
T fieldOr(const json& document, const char* name, T otherwise, const std::filesystem::path& path) {
  return document.contains(name) ? field<T>(document, name, path) : otherwise;
}

glm::dvec3 vectorOf(const std::array<double, 3>& v) {
  return {v[0], v[1], v[2]};
}

}  // namespace

RawVolume readSidecar(const std::filesystem::path& path) {
  const json document =
      readJson(path, {"file", "size", "type", "spacing", "origin", "endian", "association", "skip"});
  RawVolume volume;
  volume.data = path.parent_path() / field<std::string>(document, "file", path);
  const auto size = field<std::array<int, 3>>(document, "size", path);
  volume.lattice.size = {size[0], size[1], size[2]};
  if (*std::min_element(size.begin(), size.end()) < 1)
    fail(path, "each of the three sizes must be at least 1");
  try {
    volume.lattice.type = scalarTypeFromString(field<std::string>(document, "type", path));
  } catch (const Error& error) {
    fail(path, error.what());
  }
  volume.lattice.spacing =
      vectorOf(fieldOr<std::array<double, 3>>(document, "spacing", {1.0, 1.0, 1.0}, path));
  volume.lattice.origin = vectorOf(fieldOr<std::array<double, 3>>(document, "origin", {0.0, 0.0, 0.0}, path));
  for (int axis = 0; axis < 3; ++axis) {
    if (!(volume.lattice.spacing[axis] > 0.0)) fail(path, "each spacing must be > 0");
  }
  const auto association = fieldOr<std::string>(document, "association", "points", path);
  if (association != "points" && association != "cells") fail(path, "'association' must be points or cells");
  volume.lattice.joint = association == "cells" ? Joint::Cells : Joint::SharedPoints;
  const auto endian = fieldOr<std::string>(document, "endian", "little", path);
  if (endian != "little" && endian != "big") fail(path, "'endian' must be little or big");
  volume.bigEndian = endian == "big";
  volume.skip = fieldOr<std::uint64_t>(document, "skip", 0, path);
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(volume.data, error);
  if (error) throw Error(ErrorCode::Io, "can't open the raw file", volume.data.string());
  const std::uintmax_t expected =
      volume.skip + static_cast<std::uintmax_t>(size[0]) * static_cast<std::uintmax_t>(size[1]) *
                        static_cast<std::uintmax_t>(size[2]) * sizeOf(volume.lattice.type);
  if (bytes < expected) {
    fail(path, "the raw file has " + std::to_string(bytes) + " bytes, the sidecar needs " +
                   std::to_string(expected));
  }
  return volume;
}

Block readPart(const RawVolume& volume, const Part& part) {
  const std::size_t size = sizeOf(volume.lattice.type);
  const auto row = static_cast<std::size_t>(part.dims.x) * size;
  const std::size_t total =
      row * static_cast<std::size_t>(part.dims.y) * static_cast<std::size_t>(part.dims.z);
  const std::shared_ptr<std::byte[]> data(new std::byte[total]);
  std::ifstream file(volume.data, std::ios::binary);
  std::byte* to = data.get();
  const glm::u64vec3 whole(volume.lattice.size);
  const glm::u64vec3 first(part.first);
  for (int z = 0; z < part.dims.z; ++z) {
    for (int y = 0; y < part.dims.y; ++y) {
      const std::uint64_t index =
          ((first.z + static_cast<std::uint64_t>(z)) * whole.y + first.y + static_cast<std::uint64_t>(y)) *
              whole.x +
          first.x;
      file.seekg(static_cast<std::streamoff>(volume.skip + index * size));
      file.read(reinterpret_cast<char*>(to), static_cast<std::streamsize>(row));
      to += row;
    }
  }
  if (!file) throw Error(ErrorCode::Io, "can't read the raw file", volume.data.string());
  if (volume.bigEndian) {
    for (std::size_t i = 0; i < total; i += size) std::reverse(data.get() + i, data.get() + i + size);
  }
  Block block = emptyBlock(volume.lattice, part, data.get());
  block.keepAlive = std::shared_ptr<const void>(data, data.get());
  return block;
}

TransferFunction readTransferFunction(const std::filesystem::path& path) {
  const json document = readJson(path, {"colors", "opacities", "unit_distance"});
  TransferFunction function;
  for (const auto& node : field<std::vector<std::array<double, 4>>>(document, "colors", path)) {
    function.colors.push_back({node[0], {node[1], node[2], node[3]}});
  }
  for (const auto& node : field<std::vector<std::array<double, 2>>>(document, "opacities", path)) {
    function.opacities.push_back({node[0], node[1]});
  }
  function.unitDistance = fieldOr(document, "unit_distance", 1.0, path);
  try {
    validate(function);
  } catch (const Error& error) {
    fail(path, error.what());
  }
  return function;
}

TransferFunction defaultTransferFunction(double min, double max, double unitDistance) {
  const auto at = [&](double share) { return min + share * (max - min); };
  TransferFunction function;
  function.colors = {
      {at(0.0), {0.10, 0.15, 0.60}}, {at(0.5), {0.90, 0.85, 0.45}}, {at(1.0), {0.75, 0.10, 0.10}}};
  function.opacities = {{at(0.0), 0.0}, {at(0.33), 0.0}, {at(0.6), 0.2}, {at(1.0), 0.9}};
  function.unitDistance = unitDistance;
  return function;
}

Camera readCamera(const std::filesystem::path& path) {
  const json document =
      readJson(path, {"position", "focal_point", "view_up", "view_angle", "parallel_scale"});
  Camera camera;
  camera.position = vectorOf(field<std::array<double, 3>>(document, "position", path));
  camera.focalPoint = vectorOf(field<std::array<double, 3>>(document, "focal_point", path));
  camera.viewUp = vectorOf(fieldOr<std::array<double, 3>>(document, "view_up", {0.0, 1.0, 0.0}, path));
  camera.viewAngle = fieldOr(document, "view_angle", 30.0, path);
  camera.parallelProjection = document.contains("parallel_scale");
  camera.parallelScale = fieldOr(document, "parallel_scale", 1.0, path);
  return camera;
}

}  // namespace vdi::apps
