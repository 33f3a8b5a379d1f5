// Axis-aligned box in world space.
#pragma once

#include <glm/glm.hpp>
#include <limits>

namespace vdi {

/// Half-open where it says who owns a sample: lo <= p < hi on every axis. The default is empty.
struct Box {
  glm::dvec3 lo{std::numeric_limits<double>::infinity()};
  glm::dvec3 hi{-std::numeric_limits<double>::infinity()};

  bool operator==(const Box&) const = default;

  bool empty() const { return !(lo.x < hi.x && lo.y < hi.y && lo.z < hi.z); }
  glm::dvec3 size() const { return empty() ? glm::dvec3(0.0) : hi - lo; }
  glm::dvec3 center() const { return (lo + hi) * 0.5; }
  void include(const Box& other) {
    if (other.empty()) return;
    lo = glm::min(lo, other.lo);
    hi = glm::max(hi, other.hi);
  }
};

}  // namespace vdi
