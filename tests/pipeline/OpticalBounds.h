// Bounds on the difference between pictures and the optical model in double precision.
#pragma once

#include "tests/Catch.h"
#include "tests/OpticalScenes.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/gpu/Device.h"

namespace vdi::test {

inline GenerateSettings opticalSettings(double rate) {
  GenerateSettings settings;
  settings.width = 32;
  settings.height = 24;
  settings.supersegments = 12;
  settings.samplesPerVoxel = rate;
  return settings;
}

struct Bound {
  double largest;  // for smooth functions
  double mean;
  double pixels;  // share of pixels off by more than 8/255
};

/// Bounds for pictures, in 1/255. At eight samples per voxel, the scalar is nearly linear within a sample:
/// the measured difference is 0.3 at most and 0.04 on average. At one sample per voxel it is not, since
/// trilinear cells are cubic along a ray: 3.7 and 0.5. Steep functions make edges, and a pixel at
/// the edge of an opaque object is either right or completely wrong: 0.7 and 8 % of the pixels.
/// automaticRate is one sample per voxel or more. GPUs filter textures with 8-bit weights.
inline Bound boundOf(const gpu::Device& device, double rate, bool steep) {
  const double coarse = device.isCpu() ? 1.0 : 3.0;
  if (rate > 1.0)
    return steep ? Bound{255.0, 0.4 * coarse, 0.01 * coarse} : Bound{0.5 * coarse, 0.1 * coarse, 0.0};
  return steep ? Bound{255.0, 2.0 * coarse, 0.08} : Bound{5.0 * coarse, 0.6 * coarse, 0.0};
}

inline void checkPicture(const Image& seen, const Image& expected, const NamedFunction& named,
                         const Bound& bound) {
  const Off off = offBetween(seen, expected);
  CHECK(off.largest <= bound.largest);
  CHECK(off.mean <= bound.mean);
  CHECK(off.pixels <= bound.pixels);
  const glm::vec3 most = brightest(seen);
  for (int c = 0; c < 3; ++c) {
    if (named.lacks[c]) CHECK(most[c] == 0.0F);
  }
}

}  // namespace vdi::test
