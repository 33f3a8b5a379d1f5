// Procedural scalar fields: deterministic and defined everywhere, so that every rank fills its own blocks.
// The tool runs on fields that a device computes (DeviceField.h, shaders/field.comp); these functions define
// them.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <string>
#include <vector>

namespace vdi::synthetic {

/// Scalar in [0, 1] at a point of the unit cube.
using Field = std::function<double(const glm::dvec3&)>;

/// A field's name and a line about it.
struct FieldInfo {
  std::string name;
  std::string description;
};
const std::vector<FieldInfo>& fields();

/// Index of a field by name. Throws Error{InvalidArgument} that lists the valid names.
std::size_t fieldIndex(const std::string& name);

/// Throws Error{InvalidArgument} that lists the valid names. `seed` changes the fields with random parts.
Field makeField(const std::string& name, std::uint32_t seed);

}  // namespace vdi::synthetic
