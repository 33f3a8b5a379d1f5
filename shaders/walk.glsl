// A ray from column to column of V_O's picture. Reconstruction::Smooth blends the two lists of each that are beside the ray;
// Reconstruction::Constant looks at those that it crosses, one or two of each. Twin of walkSmoothly and walkLists in
// vdi/reference/Render.cpp.
//
// Needs: beam.glsl, look.glsl; params, smoothReconstruction, accumulate.

uint listOf(bool byColumns, int column, int row) {
  return byColumns ? uint(row) * uint(params.lists.x) + uint(column) : uint(column) * uint(params.lists.x) + uint(row);
}

// Of a point between the centres of two neighbouring lists: the other one's share, which is exactly 0 on the first one's
// centre even where rounding isn't. `beyond`: the first one's centre, in [0, 1).
float shareOfNext(float beyond) {
  const float onCentre = 1.0 / 256.0;
  return clamp((beyond - onCentre) / (1.0 - 2.0 * onCentre), 0.0, 1.0);
}

// A ray that stays in about one place of V_O's picture: the four lists around that.
void lookAlongLists(vec2 stretch) {
  vec2 place = 0.5 * (pixelAt(stretch.x) + pixelAt(stretch.y)) - 0.5;
  vec2 first = floor(place);
  float shareX = shareOfNext(place.x - first.x);
  float shareY = shareOfNext(place.y - first.y);
  uint64_t mask = maskBetween(depthAt(ray, stretch.x), depthAt(ray, stretch.y));
  vec4 light = vec4(0.0);
  float depth = infinity;
  for (int i = 0; i < 4; ++i) {
    ivec2 side = ivec2(i & 1, i >> 1);
    float weight = (side.x == 0 ? 1.0 - shareX : shareX) * (side.y == 0 ? 1.0 - shareY : shareY);
    ivec2 pixel = clamp(ivec2(first) + side, ivec2(0), params.lists - 1);
    uint list = listOf(true, pixel.x, pixel.y);
    if ((params.heads.at[list].mask & mask) == 0ul || !(weight > 0.0)) continue;
    int hint = 0;
    lookAtList(pieceOf(list, hint), placesPerT(vec2(pixel) + 0.5), stretch, hint);
    light += weight * listLight;
    depth = min(depth, listDepth);
  }
  accumulate(light, depth);
}

// Where a share of the line is passed: t, perspective taken into account.
float tAfter(PictureLine line, float share) {
  return line.t.x + (line.t.y - line.t.x) * (share * line.divisors.x) / mix(line.divisors.y, line.divisors.x, share);
}

float shareAt(PictureLine line, float along) { return clamp((along - line.along.x) * line.perColumn, 0.0, 1.0); }

float tAtEdge(PictureLine line, int column) { return tAfter(line, shareAt(line, float(column))); }

float rowAt(PictureLine line, float along) { return mix(line.across.x, line.across.y, shareAt(line, along)); }

// A column that the ray crosses, and two lists of it: those beside the ray, or those that it enters and leaves the column in.
struct Column {
  vec2 t;
  ivec2 rows;
  float share;  // of the second one
  uvec2 lists;
};

// `edges`: t where the ray enters and leaves the column.
Column columnAt(PictureLine line, int column, vec2 edges) {
  int ahead = max(line.direction, 0);
  bool begins = column == line.first;
  bool ends = column == line.last;
  vec2 along = vec2(begins ? line.along.x : float(column + 1 - ahead), ends ? line.along.y : float(column + ahead));
  Column here;
  here.t = vec2(begins ? line.t.x : edges.x, ends ? line.t.y : edges.y);
  ivec2 mostRow = ivec2(columnCount(!line.byColumns) - 1);
  if (smoothReconstruction) {
    float centre = rowAt(line, 0.5 * (along.x + along.y)) - 0.5;
    float below = floor(centre);
    here.share = shareOfNext(centre - below);
    here.rows = clamp(int(below) + ivec2(0, 1), ivec2(0), mostRow);
  } else {
    here.rows = clamp(ivec2(floor(vec2(rowAt(line, along.x), rowAt(line, along.y)))), ivec2(0), mostRow);
    // A diagonal through corners may touch a third one: not enough to look at.
    here.rows.x = clamp(here.rows.x, here.rows.y - 1, here.rows.y + 1);
    here.share = here.rows.x == here.rows.y ? 0.0 : 0.5;
  }
  here.lists = uvec2(listOf(line.byColumns, column, here.rows.x), listOf(line.byColumns, column, here.rows.y));
  return here;
}

uint64_t rayMask(vec2 t) { return maskBetween(depthAt(ray, t.x), depthAt(ray, t.y)); }

// Memory takes about as long for several as for one.
const int columnsAtOnce = 4;

// Of the columns of a tile: bit c of each word tells whether the ray may meet something in column c's first or second list.
uvec2 columnsToLookAt(PictureLine line, int tile) {
  int first = tile << renderTileShift;
  int lowest = min(line.first, line.last);
  int highest = max(line.first, line.last);
  uvec2 columns = uvec2(0u);
  float lowT = tAtEdge(line, first);
  for (int begin = 0; begin < renderTile; begin += columnsAtOnce) {
    uint64_t firstMasks[columnsAtOnce];  // where both the ray is and the list has material
    uint64_t secondMasks[columnsAtOnce];
    [[unroll]] for (int i = 0; i < columnsAtOnce; ++i) {
      int column = first + begin + i;
      float highT = tAtEdge(line, column + 1);
      // Columns beyond the line's ends: memory is read where there's a list, and what's read isn't used.
      vec2 edges = line.direction > 0 ? vec2(lowT, highT) : vec2(highT, lowT);
      Column here = columnAt(line, clamp(column, lowest, highest), edges);
      uint64_t mask = column >= lowest && column <= highest && here.t.x < here.t.y ? rayMask(here.t) : 0ul;
      firstMasks[i] = params.heads.at[here.lists.x].mask & (here.share < 1.0 ? mask : 0ul);
      secondMasks[i] = params.heads.at[here.lists.y].mask & (here.share > 0.0 ? mask : 0ul);
      lowT = highT;
    }
    [[unroll]] for (int i = 0; i < columnsAtOnce; ++i) {
      columns |= uvec2(firstMasks[i] != 0ul ? 1u : 0u, secondMasks[i] != 0ul ? 1u : 0u) << uint(begin + i);
    }
  }
  return columns;
}

// What the ray meets of the lists of a column; `looks`: at which ones.
void lookAtColumn(PictureLine line, int column, bvec2 looks, inout ivec2 hints) {
  int ahead = max(line.direction, 0);
  Column here = columnAt(line, column, vec2(tAtEdge(line, column + 1 - ahead), tAtEdge(line, column + ahead)));
  Piece firstPiece;
  Piece secondPiece;
  if (looks.x) firstPiece = pieceOf(here.lists.x, hints.x);
  if (looks.y) secondPiece = pieceOf(here.lists.y, hints.y);
  vec2 firstStretch = here.t;
  vec2 secondStretch = here.t;
  if (!smoothReconstruction && here.rows.x != here.rows.y) {
    float edge = float(max(here.rows.x, here.rows.y));
    float share = (edge - line.across.x) / (line.across.y - line.across.x);
    float split = clamp(tAfter(line, clamp(share, 0.0, 1.0)), here.t.x, here.t.y);
    firstStretch.y = split;
    secondStretch.x = split;
  }
  vec4 light = vec4(0.0);
  float depth = infinity;
  if (looks.x) {
    vec2 centre = vec2(column, here.rows.x) + 0.5;
    lookAtList(firstPiece, placesPerT(line.byColumns ? centre : centre.yx), firstStretch, hints.x);
    light = listLight;
    depth = listDepth;
  }
  if (!smoothReconstruction) accumulate(light, depth);
  light = smoothReconstruction ? (1.0 - here.share) * light : vec4(0.0);
  if (looks.y) {
    vec2 centre = vec2(column, here.rows.y) + 0.5;
    lookAtList(secondPiece, placesPerT(line.byColumns ? centre : centre.yx), secondStretch, hints.y);
    light += (smoothReconstruction ? here.share : 1.0) * listLight;
    depth = smoothReconstruction ? min(depth, listDepth) : listDepth;
  }
  accumulate(light, depth);
}

// Tile by tile: first all that there's to look at is found, then looked at, so that rays next to each other do the same at a
// time.
void walk(PictureLine line) {
  int lastTile = line.last >> renderTileShift;
  ivec2 hints = ivec2(0);
  for (int tile = line.first >> renderTileShift;; tile += line.direction) {
    tile = nextTile(line, tile, lastTile);
    if (tile < 0) return;
    uvec2 columns = columnsToLookAt(line, tile);
    while ((columns.x | columns.y) != 0u) {
      int i = line.direction > 0 ? findLSB(columns.x | columns.y) : findMSB(columns.x | columns.y);
      uint bit = 1u << i;
      lookAtColumn(line, (tile << renderTileShift) + i, bvec2((columns.x & bit) != 0u, (columns.y & bit) != 0u), hints);
      if (accumulated.a >= opaque) return;
      columns &= ~bit;
    }
    if (tile == lastTile) return;
  }
}
