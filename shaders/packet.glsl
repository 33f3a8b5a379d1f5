// Packets: the rays of a rectangle of the new picture's pixels, which are close to each other, so that empty
// space is found once for all of them.
//
// The program provides params.
#ifndef VDI_PACKET_GLSL
#define VDI_PACKET_GLSL
#include "masks.glsl"
#include "view.glsl"

struct RayPacket {
  vec2 first;   // position of the rays of its first column and row
  vec2 extent;  // distance from there to those of the last column and row
};

// The packet of a square of pixels, clipped to the picture.
RayPacket packetOf(uvec2 corner, uint size) {
  uvec2 last = min(corner + size, uvec2(params.width, params.height)) - 1u;
  return RayPacket(vec2(corner) + 0.5, vec2(last - corner));
}

int columnCount(bool byColumns) { return byColumns ? params.lists.x : params.lists.y; }

// Where a ray crosses the edge between two columns: t = distance / approach.
struct EdgeCrossing {
  float distance;
  float approach;
};

EdgeCrossing edgeCrossing(Ray of, bool byColumns, float edge) {
  float slope = (edge - 0.5 * float(columnCount(byColumns))) * params.pixelSize;
  bool parallel = params.parallel != 0u;
  float origin = byColumns ? of.origin.x : of.origin.y;
  float direction = byColumns ? of.direction.x : of.direction.y;
  return EdgeCrossing(slope * (parallel ? 1.0 : of.origin.z) - origin,
                      direction - slope * (parallel ? 0.0 : of.direction.z));
}

// Mask of the parts of the depth range between two depths, given in any order.
uint64_t maskBetween(float a, float b) {
  return maskOf(min(a, b), max(a, b), params.nearest, params.binScale);
}

// One array has the tiles of both sizes, the large ones last.
uint64_t tileDepthMask(int size, ivec2 tile) {
  ivec2 tiles = tilesOf(params.lists, size);
  ivec2 smallTiles = tilesOf(params.lists, renderTile);
  int first = size == renderTile ? 0 : smallTiles.x * smallTiles.y;
  return params.tileDepthMasks.at[first + tile.y * tiles.x + tile.x];
}

// Mask of the parts of the depth range where the packet may meet material between two edges of a column of
// tiles. A quadrilateral of rays meets the plane of an edge in the convex hull of its corners, if all corners
// cross the plane the same way and in front of V_O's eye. Between two planes, rays are straight in V_O's
// picture.
uint64_t packetMask(RayPacket packet, bool byColumns, int tile, int first, int last) {
  float begin = float(max(tile << renderTileShift, first));
  float end = float(min((tile + 1) << renderTileShift, last + 1));
  vec2 rows = vec2(infinity, -infinity);
  vec2 depths = vec2(infinity, -infinity);
  bool ascends = true;
  bool descends = true;
  bool finite = true;
  for (int i = 0; i < 8; ++i) {
    Ray of = rayAt(packet.first + vec2(i & 1, (i >> 1) & 1) * packet.extent);
    EdgeCrossing crossing = edgeCrossing(of, byColumns, i < 4 ? begin : end);
    ascends = ascends && crossing.approach > 0.0;
    descends = descends && crossing.approach < 0.0;
    float t = crossing.distance / crossing.approach;
    float depth = depthAt(of, t);
    float place = byColumns ? of.origin.y + t * of.direction.y : of.origin.x + t * of.direction.x;
    float row = place / (params.pixelSize * divisorOf(depth));
    finite = finite && abs(row) < 1e9 && abs(depth) < 1e30;
    rows = vec2(min(rows.x, row), max(rows.y, row));
    depths = vec2(min(depths.x, depth), max(depths.y, depth));
  }
  if (!finite || !(ascends || descends) || !(params.parallel != 0u || depths.x > 0.0)) return ~0ul;
  const float spare = 0.01;  // rows; masks of tiles include one row more on each side
  int rowCount = columnCount(!byColumns);
  vec2 places =
      clamp(rows + 0.5 * float(rowCount) + vec2(-spare, spare), vec2(0.0), vec2(float(rowCount - 1)));
  float spareDepth = 0.05 / params.binScale;
  uint64_t mask = maskBetween(depths.x - spareDepth, depths.y + spareDepth);
  const int maxTiles = 8;
  int size = renderTile;
  if (places.y - places.x > float(maxTiles * renderTile)) size = renderLargeTile;
  int column = (tile << renderTileShift) / size;
  int lastRow = int(places.y) / size;
  uint64_t met = 0ul;
  for (int row = int(places.x) / size; row <= lastRow; ++row) {
    met |= tileDepthMask(size, byColumns ? ivec2(column, row) : ivec2(row, column));
  }
  return met & mask;
}

#endif
