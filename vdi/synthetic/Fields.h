// Procedural scalar fields: deterministic, defined everywhere, so that every rank fills its blocks by itself.
// What the tool runs on is made by a device (DeviceField.h, shaders/field.comp); these are their definition.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <string>
#include <vector>

namespace vdi::synthetic {

/// Scalar in [0, 1] at a point of the unit cube.
using Field = std::function<double(const glm::dvec3&)>;

/// Names with a line about each.
struct FieldInfo {
  std::string name;
  std::string description;
};
const std::vector<FieldInfo>& fields();

/// Of a name among these. Throws Error{InvalidArgument} that lists the names there are.
std::size_t fieldIndex(const std::string& name);

/// Throws Error{InvalidArgument} that lists the names there are. `seed` changes the ones with random parts.
Field makeField(const std::string& name, std::uint32_t seed);

}  // namespace vdi::synthetic
