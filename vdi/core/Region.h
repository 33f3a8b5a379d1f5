// Which part of a volume is shown: cropping and clipping.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "vdi/core/Box.h"

namespace vdi {

/// Shows the side to which its normal points, as vtkPlane does for a mapper.
struct ClipPlane {
  glm::dvec3 origin{0.0};            // world, any of its points
  glm::dvec3 normal{0.0, 0.0, 1.0};  // of any length but 0
  bool operator==(const ClipPlane&) const = default;
};

inline constexpr std::size_t maxClipPlanes = 6;

/// Samples end exactly at its faces. What lies beyond still counts where values are interpolated and
/// gradients are taken, so faces show the volume's interior as it is.
struct Region {
  std::optional<Box> box;         // world; none: all of the scene
  std::vector<ClipPlane> planes;  // at most maxClipPlanes; all of them hold
  bool operator==(const Region&) const = default;
};

/// Throws Error{InvalidArgument} for a box that is empty or not finite, for too many planes, and for planes
/// that aren't finite or have no normal.
void validate(const Region& region);

/// Of a scene's bounds, what is in the region's box; empty if they don't meet.
Box boundsIn(const Region& region, const Box& scene);

}  // namespace vdi
