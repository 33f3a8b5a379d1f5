// Renders a VDI from a new viewpoint; twin of vdi/reference/Render.cpp. A ray is straight in V_O's view
// space, where each list fills the frustum of its pixel, so the ray crosses lists one after the other as a line crosses
// the cells of a picture.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "shared/render.h"
#include "masks.glsl"
#include "optical.glsl"
#include "store.glsl"
#include "pieces.glsl"

layout(local_size_x = renderGroupX, local_size_y = renderGroupY) in;
layout(set = 0, binding = 1, scalar) uniform Params { RenderParams params; };

// Reconstruction::Smooth or Constant.
layout(constant_id = 3) const bool smoothReconstruction = true;

const float opaque = 0.9999;
const float infinity = 1.0 / 0.0;

// V_O's view space, t = the new view's depth.
struct Ray {
  vec3 origin;
  vec3 direction;
};

// Of a place in the new picture, in pixels from its lower left corner.
Ray rayAt(vec2 place) {
  vec2 uv = place - 0.5 * vec2(params.width, params.height);
  return Ray(params.originBase + uv.x * params.originRight + uv.y * params.originUp,
             params.directionBase + uv.x * params.directionRight + uv.y * params.directionUp);
}

float depthAt(Ray ray, float t) { return ray.origin.z + t * ray.direction.z; }

// What a view-space place across the picture is divided by to be in the picture: V_O's projection.
float divisorOf(float depth) { return params.parallel != 0u ? 1.0 : depth; }

Ray ray;
vec4 accumulated;
float firstDepth;

void accumulate(vec4 light, float depth) {
  if (!(light.a > 0.0)) return;
  if (accumulated.a == 0.0) firstDepth = depth;
  accumulated += (1.0 - accumulated.a) * light;
}

// Keeps the part of `stretch` where value + t * slope >= 0.
void clip(inout vec2 stretch, float value, float slope) {
  float crossing = -value / slope;
  if (slope > 0.0) {
    stretch.x = max(stretch.x, crossing);
  } else if (slope < 0.0) {
    stretch.y = min(stretch.y, crossing);
  } else if (value < 0.0) {
    stretch.y = stretch.x;
  }
}

vec2 insideFrustum() {
  vec2 stretch = vec2(0.0, uintBitsToFloat(0x7f7fffffu));
  bool parallel = params.parallel != 0u;
  vec2 halfSize = 0.5 * vec2(params.lists) * params.pixelSize;
  // Not as a loop over the axes: lavapipe (Mesa 22.3) mixes up components of vectors that are indexed by a variable.
  vec2 value = halfSize * (parallel ? 1.0 : ray.origin.z);
  vec2 slope = halfSize * (parallel ? 0.0 : ray.direction.z);
  clip(stretch, value.x - ray.origin.x, slope.x - ray.direction.x);
  clip(stretch, value.x + ray.origin.x, slope.x + ray.direction.x);
  clip(stretch, value.y - ray.origin.y, slope.y - ray.direction.y);
  clip(stretch, value.y + ray.origin.y, slope.y + ray.direction.y);
  clip(stretch, ray.origin.z - params.nearest, ray.direction.z);
  clip(stretch, params.farthest - ray.origin.z, -ray.direction.z);
  return stretch;
}

vec2 pixelAt(float t) {
  vec3 p = ray.origin + t * ray.direction;
  return p.xy / (params.pixelSize * divisorOf(p.z)) + 0.5 * vec2(params.lists);
}

#include "beam.glsl"
#include "look.glsl"
#include "walk.glsl"

void main() {
  uvec2 at = gl_GlobalInvocationID.xy;
  bool hasPixel = at.x < params.width && at.y < params.height;
  ray = rayAt(vec2(at) + 0.5);
  accumulated = vec4(0.0);
  firstDepth = infinity;
  vec2 stretch = insideFrustum();
  bool meets = hasPixel && stretch.x < stretch.y;
  PictureLine line = pictureLine(stretch);
  bool along = smoothReconstruction && meets && abs(line.along.y - line.along.x) < 1.0;
  bool walks = meets && !along;
  beginLooking();
  markBeam(line, walks);
  if (along) lookAlongLists(stretch);
  if (walks) walk(line);
  if (!hasPixel) return;
  uint index = at.y * params.width + at.x;
  params.colors.at[index] = accumulated;
  params.depths.at[index] = firstDepth;
}
