// Finds the regions of a new picture that may show material. Rays of the other regions, the
// majority, skip their search. Twin of shaders/cull.comp and packet.glsl, whose comments give the
// reasons: the rays at a region's corners bound the rays between them.

import {RAYS, REGION_SHIFT, uniformsOf} from "./traverse.js";

export const REGION = 1 << REGION_SHIFT;  // pixels along a region's side

const CULL = `
out vec4 shows;  // 1: the region may show material

Ray rayAt(vec2 pixel) {
  vec2 uv = pixel * pixelScale - 0.5 * pictureSize;
  return Ray(rayOrigin[0] + uv.x * rayOrigin[1] + uv.y * rayOrigin[2],
             rayDirection[0] + uv.x * rayDirection[1] + uv.y * rayDirection[2]);
}

float least(vec4 values) { return min(min(values.x, values.y), min(values.z, values.w)); }
float most(vec4 values) { return max(max(values.x, values.y), max(values.z, values.w)); }

// Keeps the part of the stretch where value + t * slope >= 0 for any ray between the four.
void clipAny(inout vec2 stretch, vec4 value, vec4 slope) {
  vec4 crossing = -value / slope;
  if (all(greaterThan(slope, vec4(0.0)))) stretch.x = max(stretch.x, least(crossing));
  if (all(lessThan(slope, vec4(0.0)))) stretch.y = min(stretch.y, most(crossing));
}

uvec2 tileMask(bool large, ivec2 tile) {
  ivec2 small = (lists + 7) >> 3;
  int index = large ? small.x * small.y + tile.y * ((lists.x + 63) >> 6) + tile.x : tile.y * small.x + tile.x;
  return texelFetch(tiles, placeOf(index), 0).xy;
}

// Whether rays between the corners may meet material in a column of tiles.
bool meetsColumn(Ray corners[4], bool byColumns, int tile, int first, int last) {
  float begin = float(max(tile << 3, first));
  float end = float(min((tile + 1) << 3, last + 1));
  vec2 rows = vec2(infinity, -infinity);
  vec2 depths = vec2(infinity, -infinity);
  bool ascends = true;
  bool descends = true;
  bool finite = true;
  for (int i = 0; i < 8; ++i) {
    Ray ray = corners[i & 3];
    float slope = ((i < 4 ? begin : end) - 0.5 * float(columnCount(byColumns))) * pixelSize;
    vec2 along = byColumns ? vec2(ray.origin.x, ray.direction.x) : vec2(ray.origin.y, ray.direction.y);
    vec2 across = byColumns ? vec2(ray.origin.y, ray.direction.y) : vec2(ray.origin.x, ray.direction.x);
    float approach = along.y - slope * (parallel ? 0.0 : ray.direction.z);
    ascends = ascends && approach > 0.0;
    descends = descends && approach < 0.0;
    float t = (slope * (parallel ? 1.0 : ray.origin.z) - along.x) / approach;
    float depth = depthAt(ray, t);
    float row = (across.x + t * across.y) / (pixelSize * divisorOf(depth));
    finite = finite && abs(row) < 1e9 && abs(depth) < 1e30;
    rows = vec2(min(rows.x, row), max(rows.y, row));
    depths = vec2(min(depths.x, depth), max(depths.y, depth));
  }
  if (!finite || !(ascends || descends) || !(parallel || depths.x > 0.0)) return true;
  const float spare = 0.01;  // in rows; a tile's mask includes the rows next to the tile
  float rowCount = float(columnCount(!byColumns));
  vec2 places = clamp(rows + 0.5 * rowCount + vec2(-spare, spare), vec2(0.0), vec2(rowCount - 1.0));
  const float spareBins = 0.05;
  uvec2 mask = maskBetween((depths - nearest) * binScale + vec2(-spareBins, spareBins));
  bool large = places.y - places.x > 64.0;
  int lastRow = large ? int(places.y) >> 6 : int(places.y) >> 3;
  int column = large ? tile >> 3 : tile;
  for (int row = large ? int(places.x) >> 6 : int(places.x) >> 3; row <= lastRow; ++row) {
    if (sharesBit(tileMask(large, byColumns ? ivec2(column, row) : ivec2(row, column)), mask)) return true;
  }
  return false;
}

// Whether the rays may meet material between two lists and two depths of V_O's picture.
bool meetsTiles(Ray corners[4], ivec2 first, ivec2 last, vec2 depths) {
  ivec2 firstTile = first >> 3;
  ivec2 lastTile = last >> 3;
  ivec2 span = lastTile - firstTile + 1;
  const int few = 16;
  if (span.x * span.y <= few) {  // the rays hardly move in the picture: look at all tiles
    uvec2 mask = maskBetween((depths - nearest) * binScale);
    for (int y = firstTile.y; y <= lastTile.y; ++y) {
      for (int x = firstTile.x; x <= lastTile.x; ++x) {
        if (sharesBit(tileMask(false, ivec2(x, y)), mask)) return true;
      }
    }
    return false;
  }
  bool byColumns = span.x >= span.y;
  int end = byColumns ? lastTile.x : lastTile.y;
  for (int tile = byColumns ? firstTile.x : firstTile.y; tile <= end; ++tile) {
    if (meetsColumn(corners, byColumns, tile, byColumns ? first.x : first.y, byColumns ? last.x : last.y)) return true;
  }
  return false;
}

bool mayShow(Ray corners[4]) {
  vec4 originX = vec4(corners[0].origin.x, corners[1].origin.x, corners[2].origin.x, corners[3].origin.x);
  vec4 originY = vec4(corners[0].origin.y, corners[1].origin.y, corners[2].origin.y, corners[3].origin.y);
  vec4 originZ = vec4(corners[0].origin.z, corners[1].origin.z, corners[2].origin.z, corners[3].origin.z);
  vec4 directionX = vec4(corners[0].direction.x, corners[1].direction.x, corners[2].direction.x, corners[3].direction.x);
  vec4 directionY = vec4(corners[0].direction.y, corners[1].direction.y, corners[2].direction.y, corners[3].direction.y);
  vec4 directionZ = vec4(corners[0].direction.z, corners[1].direction.z, corners[2].direction.z, corners[3].direction.z);
  vec2 halfSize = 0.5 * vec2(lists) * pixelSize;
  vec4 divisor = parallel ? vec4(1.0) : originZ;
  vec4 divisorSlope = parallel ? vec4(0.0) : directionZ;
  vec2 stretch = vec2(0.0, infinity);
  clipAny(stretch, halfSize.x * divisor - originX, halfSize.x * divisorSlope - directionX);
  clipAny(stretch, halfSize.x * divisor + originX, halfSize.x * divisorSlope + directionX);
  clipAny(stretch, halfSize.y * divisor - originY, halfSize.y * divisorSlope - directionY);
  clipAny(stretch, halfSize.y * divisor + originY, halfSize.y * divisorSlope + directionY);
  clipAny(stretch, originZ - nearest, directionZ);
  clipAny(stretch, farthest - originZ, -directionZ);
  if (!(stretch.x < stretch.y)) return false;

  vec4 depthsIn = originZ + stretch.x * directionZ;
  vec4 depthsOut = originZ + stretch.y * directionZ;
  vec2 low = vec2(0.0);
  vec2 high = vec2(lists);
  vec2 depths = vec2(nearest, farthest);
  // Otherwise the rays may pass beside V_O's eye, and their positions in the picture have no
  // bounds.
  const float finite = 1e30;
  if (stretch.y < finite && (parallel || min(least(depthsIn), least(depthsOut)) > 0.0)) {
    vec4 pixelsIn = 1.0 / (pixelSize * (parallel ? vec4(1.0) : depthsIn));
    vec4 pixelsOut = 1.0 / (pixelSize * (parallel ? vec4(1.0) : depthsOut));
    vec4 xIn = (originX + stretch.x * directionX) * pixelsIn;
    vec4 xOut = (originX + stretch.y * directionX) * pixelsOut;
    vec4 yIn = (originY + stretch.x * directionY) * pixelsIn;
    vec4 yOut = (originY + stretch.y * directionY) * pixelsOut;
    const float spare = 1.0;  // for rounding
    vec2 middle = 0.5 * vec2(lists);
    low = clamp(vec2(min(least(xIn), least(xOut)), min(least(yIn), least(yOut))) + middle - spare, low, high);
    high = clamp(vec2(max(most(xIn), most(xOut)), max(most(yIn), most(yOut))) + middle + spare, low, high);
    depths = clamp(vec2(min(least(depthsIn), least(depthsOut)), max(most(depthsIn), most(depthsOut))), nearest, farthest);
  }
  return meetsTiles(corners, min(ivec2(low), lists - 1), min(ivec2(high), lists - 1), depths);
}

void main() {
  vec2 first = floor(gl_FragCoord.xy) * ${REGION}.0 + 0.5;
  vec2 last = min(first + ${REGION - 1}.0, pictureSize / pixelScale - 0.5);
  Ray corners[4] = Ray[4](rayAt(first), rayAt(vec2(last.x, first.y)), rayAt(vec2(first.x, last.y)), rayAt(last));
  shows = vec4(mayShow(corners) ? 1.0 : 0.0);
}
`;

/** @param {{rowShift: number, layerShift: number}} tiling see Variant in traverse.js */
export function cullShader(tiling) {
  return `${uniformsOf(tiling)}${RAYS}${CULL}`;
}
