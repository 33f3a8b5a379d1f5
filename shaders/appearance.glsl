// Material over one sample; twin of Appearance in vdi/reference/SegmentByMerging.cpp.
#ifndef VDI_APPEARANCE_GLSL
#define VDI_APPEARANCE_GLSL
#include "optical.glsl"

// Premultiplied colour and opacity over one sample, of material with `opticalDepth` over `length`.
vec4 appearanceOf(vec3 color, float opticalDepth, float length, float sampleStep) {
  float whole = opacityOf(opticalDepth);
  float part = opacityOf(opticalDepth * sampleStep / length);
  return vec4(whole > 0.0 ? color * (part / whole) : vec3(0.0), part);
}

// Weight of an interval behind material of that transmittance.
float weightBehind(float transmittance) { return hiddenWeight + (1.0 - hiddenWeight) * transmittance; }

float differenceOf(vec4 a, vec4 b) {
  vec4 d = abs(a - b);
  return (d.r + d.g) + (d.b + d.a);
}

#endif
