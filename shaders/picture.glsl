// Form in which a picture's pixels leave the device.
//
// The program provides params and pictureForm.
#ifndef VDI_PICTURE_GLSL
#define VDI_PICTURE_GLSL
#include "shared/render.h"

// Rounds as vdi::toByte does.
uint bytesOf(vec4 shares) {
  vec4 codes = clamp(shares, vec4(0.0), vec4(1.0)) * 255.0;
  uvec4 whole = uvec4(codes);
  whole += uvec4(greaterThanEqual(codes - vec4(whole), vec4(0.5)));
  return whole.x | whole.y << 8 | whole.z << 16 | whole.w << 24;
}

void leavePixel(uint index, vec4 light, float depth) {
  if (pictureForm == renderPictureFloats) {
    params.colors.at[index] = light;
  } else {
    float weight = pictureForm == renderPictureStraightBytes && light.a > 0.0 ? 1.0 / light.a : 1.0;
    UintArray(uint64_t(params.colors)).at[index] = bytesOf(vec4(light.rgb * weight, light.a));
  }
  params.depths.at[index] = depth;
}

#endif
