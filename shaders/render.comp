// Renders a VDI from a new viewpoint, in the tiles of its picture where cull.comp has found that rays may
// meet material. Twin of vdi/reference/Render.cpp. A ray is straight in V_O's view space, where each list
// fills the frustum of its pixel, so the ray crosses lists one after the other as a line crosses the cells of
// a picture.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "shared/render.h"
#include "masks.glsl"
#include "exact.glsl"
#include "render_segment.glsl"

layout(local_size_x_id = 2) in;
layout(push_constant, scalar) uniform Push { RenderRays rays; };
layout(set = 0, binding = 1, scalar) uniform Params { RenderParams params; };

// Whether the reconstruction is Smooth or Sheared, and not Constant.
layout(constant_id = 0) const bool smoothReconstruction = true;
// Whether the reconstruction is Sheared.
layout(constant_id = 6) const bool shearedReconstruction = false;
// Adjacent invocations that share a ray: 1, or 2, of which each handles one of the two lists of a column. Few
// rays meet material, and a GPU waits for the longest of them.
layout(constant_id = 1) const uint lanesPerRay = 1;
uint rayLane;
// Supersegments that an intersection reads at a time: if rays are long in their columns, a GPU gains by
// waiting for several at once.
layout(constant_id = 3) const int segmentsAtOnce = 1;
const int maxSegmentsAtOnce = 3;
// Assignment of a tile's pixels to invocations (shared/render.h).
layout(constant_id = 4) const uint pixelOrder = renderOrderSquares;
// Form of the picture's colours (shared/render.h).
layout(constant_id = 5) const uint pictureForm = renderPictureFloats;

// Farther material changes a pixel by a quarter of 1/255 at most, or by a half if the ray crosses many lists.
const float opaque = 1.0 - 1.0 / 1024.0;
const float opaqueAcross = 1.0 - 1.0 / 512.0;

#include "view.glsl"
#include "picture.glsl"

Ray ray;

// Keeps the part of `stretch` where value + t * slope >= 0.
void clip(inout vec2 stretch, float value, float slope) {
  float crossing = -value / slope;
  stretch.x = slope > 0.0 ? max(stretch.x, crossing) : stretch.x;
  stretch.y = slope < 0.0 ? min(stretch.y, crossing) : slope == 0.0 && value < 0.0 ? stretch.x : stretch.y;
}

vec2 insideFrustum() {
  vec2 stretch = vec2(0.0, uintBitsToFloat(0x7f7fffffu));
  bool parallel = params.parallel != 0u;
  vec2 halfSize = 0.5 * vec2(params.lists) * params.pixelSize;
  // The axes are written out, because lavapipe (Mesa 22.3) mixes up the components of a vector that a
  // variable indexes.
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

#include "packet.glsl"
#include "line.glsl"
#include "tile_mask.glsl"
#include "intersect.glsl"

Intersection accumulated;

void accumulate(Intersection behind) {
  accumulated.light += (1.0 - accumulated.light.a) * behind.light;
  accumulated.entered = min(accumulated.entered, behind.entered);
}

#include "traverse.glsl"

uvec2 placeOf(uint i) {
  if (pixelOrder == renderOrderSquares) {
    return uvec2((i & 1u) | (i >> 1 & 2u) | (i >> 2 & 4u), (i >> 1 & 1u) | (i >> 2 & 2u) | (i >> 3 & 4u));
  }
  uvec2 place = uvec2((i & 1u) | (i >> 3 & 6u), i >> 1 & 7u);
  return pixelOrder == renderOrderColumns ? place : place.yx;
}

void renderPixels(uint tile) {
  uint across = pictureTiles().x;
  uvec2 corner = uvec2(tile % across, tile / across) * renderPictureTile;
  uvec2 at = corner + placeOf(gl_LocalInvocationIndex / lanesPerRay);
  bool hasPixel = at.x < params.width && at.y < params.height;
  ray = rayAt(vec2(at) + 0.5);
  accumulated = nothing;
  vec2 stretch = insideFrustum();
  if (shearedReconstruction) {
    for (uint i = 0u; i < renderFaces; ++i) {
      vec4 face = params.boxFaces[i];
      clip(stretch, dot(face.xyz, ray.origin) - face.w, dot(face.xyz, ray.direction));
    }
  }
  for (uint i = 0u; i < params.clipPlaneCount; ++i) {
    vec4 plane = params.clipPlanes[i];
    clip(stretch, dot(plane.xyz, ray.origin) - plane.w, dot(plane.xyz, ray.direction));
  }
  if (params.hasEnds != 0u && hasPixel)
    stretch.y = min(stretch.y, params.ends.at[at.y * params.width + at.x]);
  bool meets = hasPixel && stretch.x < stretch.y;
  PictureLine line = pictureLine(stretch);
  bool along = smoothReconstruction && meets && line.columns < 1.0;
  bool traverses = meets && !along;
  beginIntersecting(line, stretch);
  findTiles(packetOf(corner, renderPictureTile), line, traverses);
  if (along) accumulate(intersectAlongLists(line, stretch));
  if (traverses) traverse(line);
  if (!hasPixel || rayLane != 0u) return;
  bool met = accumulated.light.a > 0.0;
  float fraction = clamp((accumulated.entered - line.depths.x) / max(line.depths.y, 1e-30), 0.0, 1.0);
  leavePixel(at.y * params.width + at.x, accumulated.light,
             met ? mix(stretch.x, stretch.y, fraction) : infinity);
}

// The i-th tile of the queue.
uint waitingTile(uint i) {
  uvec2 tiles = pictureTiles();
  uint kind = 0u;
  for (; kind + 1u < renderKinds && i >= params.queue.at.counts[kind]; ++kind)
    i -= params.queue.at.counts[kind];
  return params.waiting.at[kind * tiles.x * tiles.y + i];
}

// Prepares the queue for the next view.
void emptyQueue() {
  params.queue.at.groups.x = 0u;
  params.queue.at.count = 0u;
  params.queue.at.finished = 0u;
  for (uint kind = 0u; kind < renderKinds; ++kind) params.queue.at.counts[kind] = 0u;
}

void main() {
  rayLane = gl_LocalInvocationIndex % lanesPerRay;
  for (uint i = gl_WorkGroupID.x; i < params.queue.at.count; i += gl_NumWorkGroups.x) {
    renderPixels(waitingTile(i));
    barrier();  // before the tile masks are used again
  }
  barrier();  // after all invocations' last read of the queue
  if (gl_LocalInvocationIndex == 0u && atomicAdd(params.queue.at.finished, 1u) + 1u == gl_NumWorkGroups.x)
    emptyQueue();
}
