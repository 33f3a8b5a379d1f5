// Renders a VDI from a new viewpoint; twin of render in vdi/reference/Reference.cpp. A ray is straight in V_O's view
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
layout(push_constant, scalar) uniform Push { RenderConstants push; };

const float opaque = 0.9999;

vec3 rayOrigin;  // V_O's view space
vec3 rayDirection;
float rayWorldPerT;
float rayPerDepth;  // t per unit of V_O's depth
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

// World length of a unit of depth in the list's pixel.
float pixelLength(ivec2 pixel) {
  if (push.params.value.parallel != 0u) return 1.0;
  vec2 offset = (vec2(pixel) + 0.5 - 0.5 * vec2(push.params.value.lists)) * push.params.value.pixelSize;
  return sqrt(1.0 + dot(offset, offset));
}

void addPiece(Piece piece, vec2 stretch, float segmentScale) {
  vec2 t = (piece.depths - rayOrigin.z) * rayPerDepth;
  float enter = max(stretch.x, min(t.x, t.y));
  float leave = min(stretch.y, max(t.x, t.y));
  if (!(enter < leave)) return;
  float share = (leave - enter) * segmentScale / (piece.depths.y - piece.depths.x);
  float opacity = opacityOf(piece.opticalDepth * share);
  if (!(opacity > 0.0)) return;
  if (accumulated.a == 0.0) firstDepth = enter;
  accumulated += (1.0 - accumulated.a) * opacity * vec4(piece.color, 1.0);
}

float depthAt(float t) { return rayOrigin.z + t * rayDirection.z; }

// The parts of the depth range that the ray is in between two depths, in any order.
uint maskBetween(float a, float b) {
  return maskOf(min(a, b), max(a, b), push.params.value.nearest, push.params.value.binScale);
}

// Where in its list the last search ended: neighbouring lists are alike, so the next search starts there.
uint searchHint = 0u;

// What the ray meets of one list, which has supersegments [begin, end), between two depths.
void addList(ivec2 pixel, uint begin, uint end, vec2 stretch, float nearDepth, float farDepth) {
  float segmentScale = rayWorldPerT / pixelLength(pixel);
  RenderSegmentArray segments = push.params.value.segments;
  StoredForm form = push.params.value.form;
  // The first supersegment that ends behind nearDepth.
  uint low = min(begin + searchHint, end);
  while (low > begin && pieceDepths(segments, low - 1u, form).y > nearDepth) --low;
  while (low < end && !(pieceDepths(segments, low, form).y > nearDepth)) ++low;
  searchHint = low - begin;
  if (rayDirection.z >= 0.0) {
    for (uint i = low; i < end; ++i) {
      Piece piece = pieceAt(segments, i, form);
      if (piece.depths.x >= farDepth && i > low) break;
      addPiece(piece, stretch, segmentScale);
    }
  } else {
    uint stop = low;
    while (stop < end && pieceDepths(segments, stop, form).x < farDepth) ++stop;
    for (uint i = stop; i > low; --i) addPiece(pieceAt(segments, i - 1u, form), stretch, segmentScale);
  }
}

// The ray in V_O's picture is a straight line from s = 0 to s = 1. Where it's at s: t, perspective taken into account.
struct PictureLine {
  vec2 start;
  vec2 inverseDelta;
  vec2 t;      // at both ends
  vec2 depth;  // likewise; 1 where V_O's projection is parallel
};

float tAt(PictureLine line, float s) {
  return line.t.x + (line.t.y - line.t.x) * (s * line.depth.x) / mix(line.depth.y, line.depth.x, s);
}

// Where the line crosses the edges between columns and between rows. Vectors are worked on as wholes here: lavapipe
// (Mesa 22.3) mixes up components that are worked on apart.
vec2 crossings(PictureLine line, ivec2 edges) { return (vec2(edges) - line.start) * line.inverseDelta; }

void walkLists(vec2 stretch) {
  vec2 end = pixelAt(stretch.y);
  PictureLine line;
  line.start = pixelAt(stretch.x);
  line.inverseDelta = 1.0 / (end - line.start);
  line.t = stretch;
  line.depth = push.params.value.parallel != 0u ? vec2(1.0) : vec2(depthAt(stretch.x), depthAt(stretch.y));
  ivec2 lastList = push.params.value.lists - 1;
  ivec2 pixel = clamp(ivec2(floor(line.start)), ivec2(0), lastList);
  ivec2 last = clamp(ivec2(floor(end)), ivec2(0), lastList);
  ivec2 direction = sign(last - pixel);
  ivec2 ahead = max(direction, ivec2(0));
  int tilesAcross = (push.params.value.lists.x + renderTile - 1) / renderTile;
  float enterS = 0.0;
  float enterT = stretch.x;  // where s is knownS
  float knownS = 0.0;
  ivec2 knownTile = ivec2(-1);
  uint tileRay = 0u;  // depths that the ray is in, in the tile
  // At most one step per column and row.
  int most = abs(last.x - pixel.x) + abs(last.y - pixel.y) + 1;
  for (int i = 0; i < most; ++i) {
    ivec2 tile = pixel / renderTile;
    if (tile != knownTile) {
      // A tile without material along the ray is left in one step.
      knownTile = tile;
      ivec2 edge = (tile + ahead) * renderTile;
      bvec2 leaves = notEqual(last / renderTile, tile);
      vec2 s = mix(vec2(1.0), crossings(line, edge), leaves);
      float leaveS = clamp(min(s.x, s.y), enterS, 1.0);
      tileRay = maskBetween(depthAt(tAt(line, enterS)), depthAt(tAt(line, leaveS)));
      uint mask = push.params.value.tileMasks.at[tile.y * tilesAcross + tile.x];
      if ((mask & tileRay) == 0u) {
        if (!leaves.x && !leaves.y) return;
        bool stepX = leaves.x && (!leaves.y || s.x <= s.y);
        ivec2 lowest = max(tile * renderTile, min(pixel, last));
        ivec2 highest = min(tile * renderTile + renderTile - 1, max(pixel, last));
        ivec2 there = clamp(ivec2(floor(mix(line.start, end, leaveS))), lowest, highest);
        pixel = mix(there, edge + ahead - 1, bvec2(stepX, !stepX));
        enterS = leaveS;
        continue;
      }
    }
    bvec2 moves = notEqual(pixel, last);
    vec2 s = mix(vec2(2.0), crossings(line, pixel + ahead), moves);
    bool stepX = moves.x && s.x <= s.y;
    bool stepY = moves.y && !stepX;
    float leaveS = clamp(min(s.x, s.y), enterS, 1.0);
    uint list = uint(pixel.y) * uint(push.params.value.lists.x) + uint(pixel.x);
    uvec2 head = push.params.value.heads.at[list];
    if ((head.y & tileRay) != 0u) {
      if (knownS != enterS) enterT = tAt(line, enterS);
      vec2 part = vec2(enterT, tAt(line, leaveS));
      float a = depthAt(part.x);
      float b = depthAt(part.y);
      if (part.y > part.x && (head.y & maskBetween(a, b)) != 0u) {
        addList(pixel, head.x, push.params.value.heads.at[list + 1u].x, part, min(a, b), max(a, b));
        if (accumulated.a >= opaque) return;
      }
      enterT = part.y;
      knownS = leaveS;
    }
    if (!(stepX || stepY)) return;
    pixel += mix(ivec2(0), direction, bvec2(stepX, stepY));
    enterS = leaveS;
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
  // Across V_O's depths: all of a supersegment's are met at once, or none.
  rayPerDepth = 1.0 / (abs(rayDirection.z) < 1e-20 ? 1e-20 : rayDirection.z);
  accumulated = vec4(0.0);
  firstDepth = uintBitsToFloat(0x7f800000u);
  vec2 stretch = insideFrustum();
  if (stretch.x < stretch.y) walkLists(stretch);
  uint index = at.y * push.params.value.width + at.x;
  push.params.value.colors.at[index] = accumulated;
  push.params.value.depths.at[index] = firstDepth;
}
