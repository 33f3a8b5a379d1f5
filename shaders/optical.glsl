// Opacity and optical depth (-log2 of transmittance); twins of vdi/core/Supersegment.cpp.
#ifndef VDI_OPTICAL_GLSL
#define VDI_OPTICAL_GLSL
#include "shared/segmenting.h"

float opacityOf(float opticalDepth) {
  const float ln2 = 0.69314718;
  float x = opticalDepth * ln2;
  return x < 1e-3 ? x * (1.0 - 0.5 * x) : 1.0 - exp2(-opticalDepth);
}

float opticalDepthOf(float opacity) {
  const float perLn2 = 1.44269504;
  if (opacity >= 1.0) return maxOpticalDepth;
  float depth = opacity < 1e-3 ? opacity * (1.0 + 0.5 * opacity) * perLn2 : -log2(1.0 - opacity);
  return min(depth, maxOpticalDepth);
}

#endif
