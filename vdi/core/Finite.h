// A test for finite vectors.
#pragma once

#include <cmath>
#include <glm/glm.hpp>

namespace vdi {

/// Whether each component of `v` is neither infinite nor NaN.
inline bool isFinite(const glm::dvec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace vdi
