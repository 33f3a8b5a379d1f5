// Boxes separated by planes, and their order for a camera. Compositing whole pictures requires that
// order; compositing VDIs doesn't.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "vdi/core/Box.h"
#include "vdi/core/Camera.h"

namespace vdi::bench {

/// Planes that separate boxes one by one.
class SeparatingPlanes {
 public:
  /// Returns nullopt if there are boxes that no plane orthogonal to an axis separates without
  /// cutting one by more than `tolerance`. Ignores empty boxes.
  static std::optional<SeparatingPlanes> between(std::span<const Box> boxes, double tolerance);

  /// Indices of all boxes, such that no ray of the camera meets a box before an earlier one.
  std::vector<int> frontToBack(const Camera& camera) const;

 private:
  struct Node {
    int axis = 0;
    double at = 0.0;
    std::size_t lower = 0;  // child nodes; 0: a leaf
    std::size_t upper = 0;
    std::vector<int> boxes;  // a leaf's
  };
  bool split(std::size_t node, std::span<const Box> boxes, double tolerance);

  std::vector<Node> nodes_;
};

/// Cuts a box of `size` steps into `parts` boxes of nearly equal size, always across the longest
/// axis: the leaves of a k-d tree. Some are empty if there are too few steps.
std::vector<IndexBox> kdCuts(const glm::ivec3& size, int parts);

}  // namespace vdi::bench
