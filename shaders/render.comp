// Renders a VDI from a new viewpoint; twin of vdi/reference/Render.cpp. A ray is straight in V_O's view
// space, where each list fills the frustum of its pixel, so the ray crosses lists one after the other as a line crosses
// the cells of a picture.
#version 460
#extension GL_GOOGLE_include_directive : require
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

vec3 rayOrigin;  // V_O's view space
vec3 rayDirection;
float rayWorldPerT;
float rayPerDepth;  // t per unit of V_O's depth
int rayStep;  // from one supersegment of a list to the next that the ray meets: 1 or -1
vec4 accumulated;
float firstDepth;

void accumulate(vec4 light, float depth) {
  if (!(light.a > 0.0)) return;
  if (accumulated.a == 0.0) firstDepth = depth;
  accumulated += (1.0 - accumulated.a) * light;
}

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
  bool parallel = params.parallel != 0u;
  vec2 halfSize = 0.5 * vec2(params.lists) * params.pixelSize;
  // Not as a loop over the axes: lavapipe (Mesa 22.3) mixes up components of vectors that are indexed by a variable.
  vec2 value = halfSize * (parallel ? 1.0 : rayOrigin.z);
  vec2 slope = halfSize * (parallel ? 0.0 : rayDirection.z);
  clip(stretch, value.x - rayOrigin.x, slope.x - rayDirection.x);
  clip(stretch, value.x + rayOrigin.x, slope.x + rayDirection.x);
  clip(stretch, value.y - rayOrigin.y, slope.y - rayDirection.y);
  clip(stretch, value.y + rayOrigin.y, slope.y + rayDirection.y);
  clip(stretch, rayOrigin.z - params.nearest, rayDirection.z);
  clip(stretch, params.farthest - rayOrigin.z, -rayDirection.z);
  return stretch;
}

vec2 pixelAt(float t) {
  vec3 p = rayOrigin + t * rayDirection;
  float scale = 1.0 / (params.pixelSize * (params.parallel != 0u ? 1.0 : p.z));
  return p.xy * scale + 0.5 * vec2(params.lists);
}

// World length of a unit of depth in the list's pixel.
float pixelLength(ivec2 pixel) {
  if (params.parallel != 0u) return 1.0;
  vec2 offset = (vec2(pixel) + 0.5 - 0.5 * vec2(params.lists)) * params.pixelSize;
  return sqrt(1.0 + dot(offset, offset));
}

// Of one list.
vec4 listLight;
float listDepth;

float depthAt(float t) { return rayOrigin.z + t * rayDirection.z; }

// The parts of the depth range that the ray is in between two depths, in any order.
uint maskBetween(float a, float b) {
  return maskOf(min(a, b), max(a, b), params.nearest, params.binScale);
}

// Where the ray enters and leaves a supersegment's depths: t.
vec2 pieceStretch(uvec4 packed) {
  vec2 t = (pieceDepths(packed, params.form) - rayOrigin.z) * rayPerDepth;
  return rayStep > 0 ? t : t.yx;
}

// listLight and listDepth of what a stretch of the ray meets of one list, which has supersegments [begin, end), at least one.
// `hint`: where in its list the last search ended; neighbouring lists are alike, so the next search starts there.
void lookAtList(ivec2 pixel, uint begin, uint end, vec2 stretch, inout int hint) {
  listLight = vec4(0.0);
  listDepth = uintBitsToFloat(0x7f800000u);
  float segmentScale = rayWorldPerT / pixelLength(pixel);
  RenderSegmentArray segments = params.segments;
  int first = int(begin);
  int last = int(end) - 1;
  // The first supersegment, as the ray sees them, that it leaves behind the stretch's start.
  int i = clamp(first + hint, first, last);
  uvec4 packed = packedPiece(segments, uint(i));
  for (int before = i - rayStep; before >= first && before <= last; before -= rayStep) {
    uvec4 packedBefore = packedPiece(segments, uint(before));
    if (!(pieceStretch(packedBefore).y > stretch.x)) break;
    i = before;
    packed = packedBefore;
  }
  vec2 t = pieceStretch(packed);
  while (!(t.y > stretch.x)) {
    hint = i - first;
    i += rayStep;
    if (i < first || i > last) return;
    packed = packedPiece(segments, uint(i));
    t = pieceStretch(packed);
  }
  hint = i - first;
  while (t.x < stretch.y) {
    float enter = max(stretch.x, t.x);
    float leave = min(stretch.y, t.y);
    vec2 depths = pieceDepths(packed, params.form);
    float share = (leave - enter) * segmentScale / (depths.y - depths.x);
    float opacity = enter < leave ? opacityOf(pieceOpticalDepth(packed) * share) : 0.0;
    if (opacity > 0.0 && listLight.a == 0.0) listDepth = enter;
    listLight += (1.0 - listLight.a) * opacity * vec4(pieceColor(packed), 1.0);
    i += rayStep;
    if (i < first || i > last) return;
    packed = packedPiece(segments, uint(i));
    t = pieceStretch(packed);
  }
}

// The ray in V_O's picture is a straight line from s = 0 to s = 1. Where it's at s: t, perspective taken into account.
struct PictureLine {
  vec2 start;
  vec2 end;
  vec2 inverseDelta;
  vec2 t;      // at both ends
  vec2 depth;  // likewise; 1 where V_O's projection is parallel
};

PictureLine pictureLine(vec2 stretch) {
  vec2 depth = params.parallel != 0u ? vec2(1.0) : vec2(depthAt(stretch.x), depthAt(stretch.y));
  vec2 start = pixelAt(stretch.x);
  vec2 end = pixelAt(stretch.y);
  return PictureLine(start, end, 1.0 / (end - start), stretch, depth);
}

float tAt(PictureLine line, float s) {
  return line.t.x + (line.t.y - line.t.x) * (s * line.depth.x) / mix(line.depth.y, line.depth.x, s);
}

// Likewise, where the line is between two s.
uint rayBetween(PictureLine line, float enterS, float leaveS) {
  return maskBetween(depthAt(tAt(line, enterS)), depthAt(tAt(line, leaveS)));
}

uint listOf(ivec2 pixel) { return uint(pixel.y) * uint(params.lists.x) + uint(pixel.x); }

// Tiles of both sizes are in one array, the large ones behind.
int tileIndex(int size, ivec2 pixel) {
  ivec2 lists = params.lists;
  ivec2 tile = pixel / size;
  int tilesAcross = (lists.x + size - 1) / size;
  int first = 0;
  if (size == renderLargeTile) first = ((lists.x + renderTile - 1) / renderTile) * ((lists.y + renderTile - 1) / renderTile);
  return first + tile.y * tilesAcross + tile.x;
}

#include "walk_lists.glsl"
#include "walk_smoothly.glsl"

void main() {
  uvec2 at = gl_GlobalInvocationID.xy;
  if (at.x >= params.width || at.y >= params.height) return;
  float u = float(at.x) + 0.5 - 0.5 * float(params.width);
  float v = float(at.y) + 0.5 - 0.5 * float(params.height);
  rayOrigin = params.originBase + u * params.originRight + v * params.originUp;
  rayDirection = params.directionBase + u * params.directionRight + v * params.directionUp;
  rayWorldPerT = length(rayDirection);
  // Across V_O's depths: all of a supersegment's are met at once, or none.
  rayPerDepth = 1.0 / (abs(rayDirection.z) < 1e-20 ? 1e-20 : rayDirection.z);
  rayStep = rayPerDepth > 0.0 ? 1 : -1;
  accumulated = vec4(0.0);
  firstDepth = uintBitsToFloat(0x7f800000u);
  vec2 stretch = insideFrustum();
  if (stretch.x < stretch.y) {
    PictureLine line = pictureLine(stretch);
    if (smoothReconstruction) {
      walkSmoothly(line);
    } else {
      walkLists(line);
    }
  }
  uint index = at.y * params.width + at.x;
  params.colors.at[index] = accumulated;
  params.depths.at[index] = firstDepth;
}
