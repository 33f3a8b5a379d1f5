// Which parts of V_O's picture the rays of a workgroup have to walk: they form a thin beam, and what that passes without
// meeting material is found once for all of them.
//
// Needs: shared/render.h, masks.glsl; params; Ray, rayAt, depthAt, divisorOf, pixelAt, ray.

// A ray's way through V_O's picture: straight, from column to column of lists, or from row to row if it crosses more of
// these. What it goes from and to is called a column here, be it a row, and what lies across, a row.
struct PictureLine {
  bool byColumns;
  vec2 along;       // where it starts and ends, in columns
  vec2 across;      // likewise, in rows
  float perColumn;  // of the line; 0 if it stays at one place
  vec2 t;           // at both ends
  vec2 divisors;    // likewise
  int first;        // column
  int last;
  int direction;    // 1 or -1, from column to column
};

int columnCount(bool byColumns) { return byColumns ? params.lists.x : params.lists.y; }

PictureLine pictureLine(vec2 stretch) {
  PictureLine line;
  vec2 start = pixelAt(stretch.x);
  vec2 whole = pixelAt(stretch.y) - start;
  line.byColumns = 1.001 * abs(whole.x) >= abs(whole.y);  // diagonals: by columns, whatever rounding does
  line.along.x = line.byColumns ? start.x : start.y;
  line.across.x = line.byColumns ? start.y : start.x;
  vec2 extent = line.byColumns ? whole : whole.yx;
  line.along.y = line.along.x + extent.x;
  line.across.y = line.across.x + extent.y;
  line.perColumn = extent.x == 0.0 ? 0.0 : 1.0 / extent.x;
  line.t = stretch;
  line.divisors = vec2(divisorOf(depthAt(ray, stretch.x)), divisorOf(depthAt(ray, stretch.y)));
  int most = columnCount(line.byColumns) - 1;
  line.first = clamp(int(floor(line.along.x)), 0, most);
  line.last = clamp(int(floor(line.along.y)), 0, most);
  line.direction = line.last > line.first ? 1 : -1;
  return line;
}

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

// Bit t of an axis' marks: rays that go along that axis may meet material in columns of tile t.
const int invocations = int(gl_WorkGroupSize.x * gl_WorkGroupSize.y);
const int markWords = renderMostMarks / 32;
shared uint marks[2 * markWords];
shared int beamFirst[2];  // column, of all rays along that axis
shared int beamLast[2];

// The parts of the depth range that the ray is in between two depths, in any order.
uint64_t maskBetween(float a, float b) {
  return maskOf(min(a, b), max(a, b), params.nearest, params.binScale);
}

// Tiles of both sizes are in one array, the large ones behind.
uint64_t tileMask(int size, ivec2 tile) {
  ivec2 tiles = tilesOf(params.lists, size);
  ivec2 smallTiles = tilesOf(params.lists, renderTile);
  int first = size == renderTile ? 0 : smallTiles.x * smallTiles.y;
  return params.tileMasks.at[first + tile.y * tiles.x + tile.x];
}

// Whether the beam may meet material between two edges. The picture of a quadrilateral of rays on the plane of an edge is
// the convex hull of those of its corners, if all of these cross it the same way and in front of V_O's eye; and between
// two planes rays are straight in V_O's picture.
bool beamMeets(bool byColumns, int tile, int first, int last) {
  float begin = float(max(tile << renderTileShift, first));
  float end = float(min((tile + 1) << renderTileShift, last + 1));
  vec2 corner = vec2(gl_WorkGroupID.xy * gl_WorkGroupSize.xy) + 0.5;
  vec2 rows = vec2(infinity, -infinity);
  vec2 depths = vec2(infinity, -infinity);
  bool ascends = true;
  bool descends = true;
  bool finite = true;
  for (int i = 0; i < 8; ++i) {
    vec2 side = vec2(i & 1, (i >> 1) & 1) * vec2(gl_WorkGroupSize.xy - 1u);
    Ray of = rayAt(corner + side);
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
  if (!finite || !(ascends || descends) || !(params.parallel != 0u || depths.x > 0.0)) return true;
  const float spare = 0.01;  // rows; masks of tiles know a row more than they hold
  int rowCount = columnCount(!byColumns);
  vec2 places = clamp(rows + 0.5 * float(rowCount) + vec2(-spare, spare), vec2(0.0), vec2(float(rowCount - 1)));
  float spareDepth = 0.05 / params.binScale;
  uint64_t beam = maskBetween(depths.x - spareDepth, depths.y + spareDepth);
  const int mostTiles = 8;
  int size = renderTile;
  if (places.y - places.x > float(mostTiles * renderTile)) size = renderLargeTile;
  int column = (tile << renderTileShift) / size;
  int lastRow = int(places.y) / size;
  for (int row = int(places.x) / size; row <= lastRow; ++row) {
    if ((tileMask(size, byColumns ? ivec2(column, row) : ivec2(row, column)) & beam) != 0ul) return true;
  }
  return false;
}

void markAlong(int axis) {
  bool byColumns = axis == 0;
  int first = beamFirst[axis];
  int last = beamLast[axis];
  int lastTile = last >> renderTileShift;  // none: -1 stays -1
  for (int tile = (first >> renderTileShift) + int(gl_LocalInvocationIndex); tile <= lastTile;
       tile += invocations) {
    if (beamMeets(byColumns, tile, first, last)) atomicOr(marks[axis * markWords + (tile >> 5)], 1u << (tile & 31));
  }
}

// For all invocations of a workgroup, those whose ray doesn't walk included.
void markBeam(PictureLine line, bool walks) {
  int own = int(gl_LocalInvocationIndex);
  for (int i = own; i < 2 * markWords; i += invocations) marks[i] = 0u;
  if (own < 2) {
    beamFirst[own] = 0x7fffffff;
    beamLast[own] = -1;
  }
  barrier();
  if (walks) {
    int axis = line.byColumns ? 0 : 1;
    atomicMin(beamFirst[axis], min(line.first, line.last));
    atomicMax(beamLast[axis], max(line.first, line.last));
  }
  barrier();
  markAlong(0);
  markAlong(1);
  barrier();
}

// The first tile to walk from `tile` to `last`, in the line's direction; -1 if there's none.
int nextTile(PictureLine line, int tile, int last) {
  int base = line.byColumns ? 0 : markWords;
  int word = tile >> 5;
  int lastWord = last >> 5;
  uint ahead = line.direction > 0 ? ~0u << (tile & 31) : ~0u >> (31 - (tile & 31));
  uint bits = marks[base + word] & ahead;
  while (bits == 0u && word != lastWord) {
    word += line.direction;
    bits = marks[base + word];
  }
  if (bits == 0u) return -1;
  int found = word * 32 + (line.direction > 0 ? findLSB(bits) : findMSB(bits));
  return (last - found) * line.direction < 0 ? -1 : found;
}
