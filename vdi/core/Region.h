// The part of a volume that is shown: cropping and clipping.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "vdi/core/Box.h"

namespace vdi {

/// A plane that shows the side to which its normal points, as vtkPlane does for a mapper.
struct ClipPlane {
  glm::dvec3 origin{0.0};            // any point of the plane, world
  glm::dvec3 normal{0.0, 0.0, 1.0};  // any length but 0
  bool operator==(const ClipPlane&) const = default;
};

inline constexpr std::size_t maxClipPlanes = 6;

/// The part of the volume whose samples count. Samples end exactly at its faces. Values beyond still take
/// part in interpolation and gradients, so faces show the volume's interior as it is.
struct Region {
  std::optional<Box> box;         // world; none: the whole scene
  std::vector<ClipPlane> planes;  // at most maxClipPlanes; a point must satisfy all of them
  bool operator==(const Region&) const = default;
};

/// Throws Error{InvalidArgument} for a box that is empty or not finite, for too many planes, and for planes
/// that are not finite or have no normal.
void validate(const Region& region);

/// The part of a scene's bounds inside the region's box; empty if they do not meet.
Box boundsIn(const Region& region, const Box& scene);

}  // namespace vdi
