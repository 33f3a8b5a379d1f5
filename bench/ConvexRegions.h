// Boxes that planes separate, and the order in which a camera sees them. Compositing of whole pictures needs
// it; VDIs don't.
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
  /// None: there are boxes that no plane orthogonal to an axis separates without cutting one, by more than
  /// `tolerance`. Empty boxes are never in the way.
  static std::optional<SeparatingPlanes> between(std::span<const Box> boxes, double tolerance);

  /// Indices of all boxes: no ray of the camera meets a box before one that precedes it here.
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

/// A box of `size` steps cut into `parts` boxes of nearly equal size, always across the longest axis: a k-d
/// tree's leaves. Some are empty where there are too few steps.
std::vector<IndexBox> kdCuts(const glm::ivec3& size, int parts);

}  // namespace vdi::bench
