// The new view's rays in V_O's view space.
//
// The program provides params and rays.
#ifndef VDI_VIEW_GLSL
#define VDI_VIEW_GLSL
#include "shared/render.h"

const float infinity = 1.0 / 0.0;

// A ray in V_O's view space; t is the new view's depth.
struct Ray {
  vec3 origin;
  vec3 direction;
};

// The ray of a position in the new picture, in pixels from its lower left corner.
Ray rayAt(vec2 place) {
  vec2 uv = place - 0.5 * vec2(params.width, params.height);
  return Ray(rays.originBase + uv.x * rays.originRight + uv.y * rays.originUp,
             rays.directionBase + uv.x * rays.directionRight + uv.y * rays.directionUp);
}

float depthAt(Ray ray, float t) { return ray.origin.z + t * ray.direction.z; }

// Divisor of V_O's projection from view space to the picture.
float divisorOf(float depth) { return params.parallel != 0u ? 1.0 : depth; }

// Position in V_O's picture of a point of a ray, in lists from its lower left corner.
vec2 pictureAt(Ray of, float t) {
  vec3 p = of.origin + t * of.direction;
  return p.xy / (params.pixelSize * divisorOf(p.z)) + 0.5 * vec2(params.lists);
}

// Number of tiles of renderPictureTile x renderPictureTile pixels.
uvec2 pictureTiles() {
  return (uvec2(params.width, params.height) + renderPictureTile - 1u) / renderPictureTile;
}

#endif
