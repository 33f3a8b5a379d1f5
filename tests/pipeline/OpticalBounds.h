// How far pictures may be from the optical model in double precision.
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
  double largest;  // of smooth functions
  double mean;
  double pixels;  // share of them that's off by more than 8/255
};

/// Of pictures, in 1/255. At eight samples a voxel rays are straight enough within a sample: 0.3 were
/// measured, on average 0.04. At one a voxel the scalar isn't linear along a sample, as trilinear cells are
/// cubic along it: 3.7 and 0.5. Steep functions make edges, and a pixel at an edge of something opaque is all
/// wrong or right: 0.7 and 8 % of the pixels. Textures of GPUs have weights of 8 bits.
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
