// Axis-aligned boxes, in world space and of lattice indices.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <vector>

namespace vdi {

/// A box in world space. As an owned box it is half-open: lo <= p < hi on every axis. The default is empty.
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
  Box intersection(const Box& other) const { return {glm::max(lo, other.lo), glm::min(hi, other.hi)}; }
};

/// Lattice indices lo <= i < hi on every axis. The default is empty.
struct IndexBox {
  glm::ivec3 lo{0};
  glm::ivec3 hi{0};

  bool operator==(const IndexBox&) const = default;

  bool empty() const { return lo.x >= hi.x || lo.y >= hi.y || lo.z >= hi.z; }
  glm::ivec3 size() const { return empty() ? glm::ivec3(0) : hi - lo; }
  std::size_t count() const {
    const auto n = glm::u64vec3(size());
    return n.x * n.y * n.z;
  }
  bool contains(const glm::ivec3& at) const {
    return glm::all(glm::greaterThanEqual(at, lo)) && glm::all(glm::lessThan(at, hi));
  }
  /// Position of the value with index `at` in an array of the box's values, x fastest.
  std::size_t position(const glm::ivec3& at) const {
    const auto n = glm::u64vec3(hi - lo);
    const auto i = glm::u64vec3(at - lo);
    return (i.z * n.y + i.y) * n.x + i.x;
  }
  void include(const IndexBox& other) {
    if (other.empty()) return;
    *this = empty() ? other : IndexBox{glm::min(lo, other.lo), glm::max(hi, other.hi)};
  }
  IndexBox intersection(const IndexBox& other) const {
    return {glm::max(lo, other.lo), glm::min(hi, other.hi)};
  }
};

/// Calls visit(part) for the part of `box` outside `hole`, as at most six disjoint boxes. The parts below and
/// above `hole` in z are whole slices. Works for Box and IndexBox.
template <typename AnyBox, typename Visit>
void forEachPartWithout(const AnyBox& box, const AnyBox& hole, Visit visit) {
  const AnyBox common = box.intersection(hole);
  if (common.empty()) return visit(box);
  AnyBox middle = box;
  for (int axis = 2; axis >= 0; --axis) {
    AnyBox part = middle;
    part.hi[axis] = common.lo[axis];
    if (!part.empty()) visit(part);
    part = middle;
    part.lo[axis] = common.hi[axis];
    if (!part.empty()) visit(part);
    middle.lo[axis] = common.lo[axis];
    middle.hi[axis] = common.hi[axis];
  }
}

/// The parts that forEachPartWithout visits.
template <typename AnyBox>
std::vector<AnyBox> without(const AnyBox& box, const AnyBox& hole) {
  std::vector<AnyBox> parts;
  forEachPartWithout(box, hole, [&parts](const AnyBox& part) { parts.push_back(part); });
  return parts;
}

/// Replaces boxes by their parts outside `hole`.
void subtract(std::vector<IndexBox>& boxes, const IndexBox& hole);

/// Disjoint boxes that cover exactly the `open` cells (x fastest) of a lattice of `size`. Boxes grow along x,
/// then y, then z, so a box of open cells stays one box.
std::vector<IndexBox> coverWithBoxes(const glm::ivec3& size, std::vector<bool> open);

/// The part of `box` outside all `holes`, as few disjoint boxes whose faces are faces of `box` and `holes`.
std::vector<Box> withoutAll(const Box& box, const std::vector<Box>& holes);

}  // namespace vdi
