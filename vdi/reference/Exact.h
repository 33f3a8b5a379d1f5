// The optical model alone, in double precision: the right picture, independent of any method. It shares
// nothing with the rest, so it exposes errors that device, reference and VDI have in common: no blocks, no
// lattice of samples, no transfer table, no slabs, no 8-bit pictures.
#pragma once

#include <vector>

#include "vdi/core/Blending.h"
#include "vdi/core/Box.h"
#include "vdi/core/Camera.h"
#include "vdi/core/Image.h"
#include "vdi/core/TransferFunction.h"

namespace vdi::reference {

/// A whole volume of doubles; trilinear between values or the nearest one, constant beyond the outermost
/// ones.
struct ExactVolume {
  glm::ivec3 dims{0};          // values per axis, each >= 1
  glm::dvec3 origin{0.0};      // position of the first value, world
  glm::dvec3 spacing{1.0};     // > 0
  Box bounds;                  // the visible part: from point to point, or whole cells
  std::vector<double> values;  // [dims.z][dims.y][dims.x]
  bool nearest = false;
  /// Volumes that give colours: none; one, which the function colours; or red, green and blue.
  std::vector<ExactVolume> colors{};

  double at(const glm::dvec3& world) const;
};

/// Light and transmittance of a ray: with s its length in world units and t(s) = (1 -
/// opacity(s))^(s/unitDistance) along it, the integral of colour * -dt. Each of `samples` parts of equal
/// length has the colour and opacity of its middle. The scalar must be finite everywhere. Returns
/// premultiplied colour and opacity.
glm::dvec4 integrate(const ExactVolume& volume, const TransferFunction& function, const glm::dvec3& from,
                     const glm::dvec3& to, int samples);

/// Premultiplied colour and opacity of the largest or smallest scalar at the ends of `parts` parts of a ray.
glm::dvec4 project(const ExactVolume& volume, const TransferFunction& function, const glm::dvec3& from,
                   const glm::dvec3& to, int parts, bool largest);

/// Premultiplied colour and opacity of the isovalues between the scalars at the ends of each of `parts` parts
/// of a ray, front to back.
glm::dvec4 cross(const ExactVolume& volume, const TransferFunction& function,
                 const std::vector<double>& isovalues, const glm::dvec3& from, const glm::dvec3& to,
                 int parts);

/// The picture of the camera, row 0 at the bottom, without depths: a ray through each pixel's centre, with
/// `samplesPerVoxel` samples for each voxel that it may cross. Isosurfaces are unshaded.
Image renderExactly(const ExactVolume& volume, const TransferFunction& function, const Camera& camera,
                    int width, int height, int samplesPerVoxel = 64, const Blending& blending = {});

}  // namespace vdi::reference
