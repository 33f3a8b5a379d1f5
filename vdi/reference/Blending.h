// Blend modes other than composite, on the CPU (vdi/core/Blending.h). Twin of shaders/blending.glsl.
#pragma once

#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <span>

#include "vdi/core/Blending.h"

namespace vdi::reference {

/// The extreme of the scalars along a ray.
class Projection {
 public:
  /// `mode` is Maximum or Minimum.
  explicit Projection(BlendMode mode) : mode_(mode) {}

  struct Extreme {
    double position = 0.0;  // in the transfer table
    float depth = 0.0F;     // where it first occurs
  };
  /// Takes a scalar into account; NaN counts as no scalar.
  void add(double position, float depth);
  const std::optional<Extreme>& extreme() const { return extreme_; }

 private:
  BlendMode mode_;
  std::optional<Extreme> extreme_;
};

/// Premultiplied colour and opacity of the isosurfaces that a sample crosses on its way from one position in
/// the transfer table to another, nearest first. `lightAt` gives the light at a share of that way. `surfaces`
/// are in ascending order. A sample that begins at a surface, or ends there from above, doesn't cross it; one
/// that ends there from below does.
glm::vec4 crossed(std::span<const Isosurface> surfaces, double front, double back,
                  const std::function<glm::vec3(double share)>& lightAt);

}  // namespace vdi::reference
