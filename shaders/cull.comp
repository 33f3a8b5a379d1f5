// Finds the tiles of the new picture whose rays may meet material, for render.comp, and blanks the others,
// which are most of a picture. The tiles with the most work come first, because a GPU waits for the last one.
// A workgroup examines the packet of a region.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/render.h"
#include "masks.glsl"

layout(local_size_x = renderCullGroup) in;
// If false, tiles keep their order: a CPU does not wait for the last one, and benefits from its caches.
layout(constant_id = 0) const bool busiestFirst = true;
// Form of the picture's colours (shared/render.h).
layout(constant_id = 1) const uint pictureForm = renderPictureFloats;
layout(push_constant, scalar) uniform Push { RenderRays rays; };
layout(set = 0, binding = 1, scalar) uniform Params { RenderParams params; };

#include "view.glsl"
#include "picture.glsl"
#include "packet.glsl"

float minimum(vec4 values) { return min(min(values.x, values.y), min(values.z, values.w)); }
float maximum(vec4 values) { return max(max(values.x, values.y), max(values.z, values.w)); }

// Keeps the part of `stretch` where value + t * slope >= 0 for any ray of a packet. The components belong to
// its corners: if all corners cross a plane the same way, the rays between them cross it between the corners'
// crossings.
void clipAny(inout vec2 stretch, vec4 value, vec4 slope) {
  vec4 crossing = -value / slope;
  if (all(greaterThan(slope, vec4(0.0)))) stretch.x = max(stretch.x, minimum(crossing));
  if (all(lessThan(slope, vec4(0.0)))) stretch.y = min(stretch.y, maximum(crossing));
}

// Bounds of a packet's positions in V_O's picture, and of its depths. Empty: leave <= enter.
struct Reach {
  float enter;
  float leave;
  vec2 low;
  vec2 high;
  vec2 depths;
};

Reach reachOf(RayPacket packet) {
  Ray a = rayAt(packet.first);
  Ray b = rayAt(packet.first + vec2(packet.extent.x, 0.0));
  Ray c = rayAt(packet.first + vec2(0.0, packet.extent.y));
  Ray d = rayAt(packet.first + packet.extent);
  vec4 originX = vec4(a.origin.x, b.origin.x, c.origin.x, d.origin.x);
  vec4 originY = vec4(a.origin.y, b.origin.y, c.origin.y, d.origin.y);
  vec4 originZ = vec4(a.origin.z, b.origin.z, c.origin.z, d.origin.z);
  vec4 directionX = vec4(a.direction.x, b.direction.x, c.direction.x, d.direction.x);
  vec4 directionY = vec4(a.direction.y, b.direction.y, c.direction.y, d.direction.y);
  vec4 directionZ = vec4(a.direction.z, b.direction.z, c.direction.z, d.direction.z);

  bool parallel = params.parallel != 0u;
  vec2 halfSize = 0.5 * vec2(params.lists) * params.pixelSize;
  vec4 divisor = parallel ? vec4(1.0) : originZ;
  vec4 divisorSlope = parallel ? vec4(0.0) : directionZ;
  vec2 stretch = vec2(0.0, uintBitsToFloat(0x7f7fffffu));
  clipAny(stretch, halfSize.x * divisor - originX, halfSize.x * divisorSlope - directionX);
  clipAny(stretch, halfSize.x * divisor + originX, halfSize.x * divisorSlope + directionX);
  clipAny(stretch, halfSize.y * divisor - originY, halfSize.y * divisorSlope - directionY);
  clipAny(stretch, halfSize.y * divisor + originY, halfSize.y * divisorSlope + directionY);
  clipAny(stretch, originZ - params.nearest, directionZ);
  clipAny(stretch, params.farthest - originZ, -directionZ);

  vec4 depthsIn = originZ + stretch.x * directionZ;
  vec4 depthsOut = originZ + stretch.y * directionZ;
  Reach reach =
      Reach(stretch.x, stretch.y, vec2(0.0), vec2(params.lists), vec2(params.nearest, params.farthest));
  // Else the bounds stay those of the whole picture: points beside V_O's eye project without bounds.
  const float finite = 1e30;
  if (stretch.y < finite && (parallel || min(minimum(depthsIn), minimum(depthsOut)) > 0.0)) {
    vec4 pixelsIn = 1.0 / (params.pixelSize * (parallel ? vec4(1.0) : depthsIn));
    vec4 pixelsOut = 1.0 / (params.pixelSize * (parallel ? vec4(1.0) : depthsOut));
    vec4 xIn = (originX + stretch.x * directionX) * pixelsIn;
    vec4 xOut = (originX + stretch.y * directionX) * pixelsOut;
    vec4 yIn = (originY + stretch.x * directionY) * pixelsIn;
    vec4 yOut = (originY + stretch.y * directionY) * pixelsOut;
    const float spare = 1.0;  // for rounding
    vec2 middle = 0.5 * vec2(params.lists);
    reach.low =
        clamp(vec2(min(minimum(xIn), minimum(xOut)), min(minimum(yIn), minimum(yOut))) + middle - spare,
              reach.low, reach.high);
    reach.high =
        clamp(vec2(max(maximum(xIn), maximum(xOut)), max(maximum(yIn), maximum(yOut))) + middle + spare,
              reach.low, reach.high);
    reach.depths =
        clamp(vec2(min(minimum(depthsIn), minimum(depthsOut)), max(maximum(depthsIn), maximum(depthsOut))),
              params.nearest, params.farthest);
  }
  return reach;
}

uint countOf(uint64_t mask) {
  uvec2 words = unpackUint2x32(mask);
  return uint(bitCount(words.x) + bitCount(words.y));
}

// Number of places where the packet may meet material: parts of the depth range, tile by tile. Each
// invocation counts its own tile.
uint placesToIntersect(RayPacket packet) {
  Reach reach = reachOf(packet);
  if (!(reach.enter < reach.leave)) return 0u;
  int own = int(gl_LocalInvocationIndex);
  ivec2 first = min(ivec2(reach.low), params.lists - 1);
  ivec2 last = min(ivec2(reach.high), params.lists - 1);
  ivec2 firstTile = first >> renderTileShift;
  ivec2 lastTile = last >> renderTileShift;
  ivec2 tiles = lastTile - firstTile + 1;
  const int few = 16;
  if (tiles.x * tiles.y <= few) {
    // Rays that hardly move in the picture may meet all of these tiles.
    if (own >= tiles.x * tiles.y) return 0u;
    ivec2 tile = firstTile + ivec2(own % tiles.x, own / tiles.x);
    return countOf(tileDepthMask(renderTile, tile) & maskBetween(reach.depths.x, reach.depths.y));
  }
  bool byColumns = tiles.x >= tiles.y;
  int end = byColumns ? lastTile.x : lastTile.y;
  uint count = 0u;
  for (int tile = (byColumns ? firstTile.x : firstTile.y) + own; tile <= end; tile += int(renderCullGroup)) {
    count += countOf(
        packetMask(packet, byColumns, tile, byColumns ? first.x : first.y, byColumns ? last.x : last.y));
  }
  return count;
}

// Twice the logarithm of `count`.
uint magnitude(uint count) {
  int exponent = findMSB(count);
  return 2u * uint(exponent) + (exponent > 0 ? count >> (exponent - 1) & 1u : 0u);
}

shared uint places;

void main() {
  uvec2 corner = gl_WorkGroupID.xy * renderRegion;
  uint own = gl_LocalInvocationIndex;
  if (own == 0u) places = 0u;
  barrier();
  uint count = placesToIntersect(packetOf(corner, renderRegion));
  if (count > 0u) atomicAdd(places, count);
  barrier();
  uvec2 size = uvec2(params.width, params.height);
  if (places == 0u) {
    for (uint i = own; i < renderRegion * renderRegion; i += renderCullGroup) {
      uvec2 at = corner + uvec2(i % renderRegion, i / renderRegion);
      if (any(greaterThanEqual(at, size))) continue;
      leavePixel(at.y * params.width + at.x, vec4(0.0), infinity);
    }
    return;
  }
  const uint tilesAcross = renderRegion / renderPictureTile;
  if (own >= tilesAcross * tilesAcross) return;
  uvec2 tile = corner / renderPictureTile + uvec2(own % tilesAcross, own / tilesAcross);
  uvec2 tiles = pictureTiles();
  if (any(greaterThanEqual(tile, tiles))) return;
  uint kind = busiestFirst ? renderKinds - 1u - min(magnitude(places), renderKinds - 1u) : 0u;
  uint total = atomicAdd(params.queue.at.count, 1u);
  atomicMax(params.queue.at.groups.x, min(total + 1u, renderMaxGroups));
  uint place = atomicAdd(params.queue.at.counts[kind], 1u);
  params.waiting.at[kind * tiles.x * tiles.y + place] = tile.y * tiles.x + tile.x;
}
