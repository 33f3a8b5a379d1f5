// Renders a VDI from a new viewpoint; twin of render in vdi/reference/Reference.cpp. A ray is straight in V_O's view
// space, where each list fills the frustum of its pixel, so the ray crosses lists one after the other as a line crosses
// the cells of a picture.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/render.h"
#include "optical.glsl"

layout(local_size_x = renderGroupX, local_size_y = renderGroupY) in;
layout(push_constant, scalar) uniform Push { RenderConstants push; };

const float opaque = 0.9999;

vec3 rayOrigin;  // V_O's view space
vec3 rayDirection;
float rayWorldPerT;
vec4 accumulated;
float firstDepth;

// Keeps the part of `stretch` where value + t * slope >= 0.
void clip(inout vec2 stretch, float value, float slope) {
  if (slope > 0.0) {
    stretch.x = max(stretch.x, -value / slope);
  } else if (slope < 0.0) {
    stretch.y = min(stretch.y, -value / slope);
  } else if (value < 0.0) {
    stretch.y = stretch.x;
  }
}

vec2 insideFrustum() {
  vec2 stretch = vec2(0.0, uintBitsToFloat(0x7f7fffffu));
  bool parallel = push.params.value.parallel != 0u;
  vec2 halfSize = 0.5 * vec2(push.params.value.lists) * push.params.value.pixelSize;
  // Not as a loop over the axes: lavapipe (Mesa 22.3) mixes up components of vectors that are indexed by a variable.
  vec2 value = halfSize * (parallel ? 1.0 : rayOrigin.z);
  vec2 slope = halfSize * (parallel ? 0.0 : rayDirection.z);
  clip(stretch, value.x - rayOrigin.x, slope.x - rayDirection.x);
  clip(stretch, value.x + rayOrigin.x, slope.x + rayDirection.x);
  clip(stretch, value.y - rayOrigin.y, slope.y - rayDirection.y);
  clip(stretch, value.y + rayOrigin.y, slope.y + rayDirection.y);
  clip(stretch, rayOrigin.z - push.params.value.nearest, rayDirection.z);
  clip(stretch, push.params.value.farthest - rayOrigin.z, -rayDirection.z);
  return stretch;
}

vec2 pixelAt(float t) {
  vec3 p = rayOrigin + t * rayDirection;
  float scale = 1.0 / (push.params.value.pixelSize * (push.params.value.parallel != 0u ? 1.0 : p.z));
  return p.xy * scale + 0.5 * vec2(push.params.value.lists);
}

// Where the ray crosses the planes between columns and between rows at image coordinates `pixel`.
vec2 crossings(ivec2 pixel) {
  vec2 slope = (vec2(pixel) - 0.5 * vec2(push.params.value.lists)) * push.params.value.pixelSize;
  if (push.params.value.parallel != 0u) return (slope - rayOrigin.xy) / rayDirection.xy;
  return (slope * rayOrigin.z - rayOrigin.xy) / (rayDirection.xy - slope * rayDirection.z);
}

// World length of a unit of depth in the list's pixel.
float pixelLength(ivec2 pixel) {
  if (push.params.value.parallel != 0u) return 1.0;
  vec2 offset = (vec2(pixel) + 0.5 - 0.5 * vec2(push.params.value.lists)) * push.params.value.pixelSize;
  return sqrt(1.0 + dot(offset, offset));
}

void addSegment(Segment s, vec2 stretch, float segmentScale) {
  clip(stretch, rayOrigin.z - s.front, rayDirection.z);
  clip(stretch, s.back - rayOrigin.z, -rayDirection.z);
  if (!(stretch.x < stretch.y)) return;
  float share = (stretch.y - stretch.x) * segmentScale / (s.back - s.front);
  float opacity = opacityOf(opticalDepthOf(s.opacity) * share);
  if (!(opacity > 0.0)) return;
  if (accumulated.a == 0.0) firstDepth = stretch.x;
  accumulated += (1.0 - accumulated.a) * (opacity / s.opacity) * vec4(s.red, s.green, s.blue, s.opacity);
}

// What the ray meets of one list.
void addList(ivec2 pixel, vec2 stretch) {
  uint list = uint(pixel.y) * uint(push.params.value.lists.x) + uint(pixel.x);
  uint begin = push.params.value.offsets.at[list];
  uint end = push.params.value.offsets.at[list + 1u];
  if (begin == end) return;
  float enterDepth = rayOrigin.z + stretch.x * rayDirection.z;
  float leaveDepth = rayOrigin.z + stretch.y * rayDirection.z;
  float nearDepth = min(enterDepth, leaveDepth);
  float farDepth = max(enterDepth, leaveDepth);
  float segmentScale = rayWorldPerT / pixelLength(pixel);
  // The first supersegment that ends behind nearDepth.
  uint low = begin;
  uint high = end;
  while (low < high) {
    uint middle = (low + high) / 2u;
    if (push.params.value.segments.at[middle].back > nearDepth) {
      high = middle;
    } else {
      low = middle + 1u;
    }
  }
  if (rayDirection.z >= 0.0) {
    for (uint i = low; i < end; ++i) {
      Segment s = push.params.value.segments.at[i];
      if (s.front >= farDepth && i > low) break;
      addSegment(s, stretch, segmentScale);
    }
  } else {
    uint stop = low;
    while (stop < end && push.params.value.segments.at[stop].front < farDepth) ++stop;
    for (uint i = stop; i > low; --i) addSegment(push.params.value.segments.at[i - 1u], stretch, segmentScale);
  }
}

void walkLists(vec2 stretch) {
  ivec2 lastList = push.params.value.lists - 1;
  ivec2 pixel = clamp(ivec2(floor(pixelAt(stretch.x))), ivec2(0), lastList);
  ivec2 last = clamp(ivec2(floor(pixelAt(stretch.y))), ivec2(0), lastList);
  ivec2 direction = sign(last - pixel);
  float enter = stretch.x;
  // At most one step per column and row.
  int most = abs(last.x - pixel.x) + abs(last.y - pixel.y) + 1;
  for (int i = 0; i < most; ++i) {
    vec2 t = crossings(pixel + max(direction, ivec2(0)));
    bool movesX = pixel.x != last.x;
    bool movesY = pixel.y != last.y;
    bool stepX = movesX && (!movesY || t.x <= t.y);
    bool stepY = movesY && !stepX;
    float leave = clamp(stepX ? t.x : stepY ? t.y : stretch.y, enter, stretch.y);
    if (leave > enter) addList(pixel, vec2(enter, leave));
    if (!(stepX || stepY) || accumulated.a >= opaque) return;
    pixel += ivec2(stepX ? direction.x : 0, stepY ? direction.y : 0);
    enter = leave;
  }
}

void main() {
  uvec2 at = gl_GlobalInvocationID.xy;
  if (at.x >= push.params.value.width || at.y >= push.params.value.height) return;
  float u = float(at.x) + 0.5 - 0.5 * float(push.params.value.width);
  float v = float(at.y) + 0.5 - 0.5 * float(push.params.value.height);
  rayOrigin = push.params.value.originBase + u * push.params.value.originRight + v * push.params.value.originUp;
  rayDirection = push.params.value.directionBase + u * push.params.value.directionRight + v * push.params.value.directionUp;
  rayWorldPerT = length(rayDirection);
  accumulated = vec4(0.0);
  firstDepth = uintBitsToFloat(0x7f800000u);
  vec2 stretch = insideFrustum();
  if (stretch.x < stretch.y) walkLists(stretch);
  uint index = at.y * push.params.value.width + at.x;
  push.params.value.colors.at[index] = accumulated;
  push.params.value.depths.at[index] = firstDepth;
}
