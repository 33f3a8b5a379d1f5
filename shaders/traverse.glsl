// Traverses a ray from column to column of V_O's picture. Reconstruction::Smooth and Sheared blend the two
// lists of each column that are beside the ray; Reconstruction::Constant uses the one or two that the ray
// crosses. Twin of traverseSmoothly and traverseLists in vdi/reference/Render.cpp.
//
// Needs: masks.glsl, tile_mask.glsl, line.glsl, intersect.glsl; params, smoothReconstruction, lanesPerRay,
// rayLane, accumulate.

uint listOf(bool byColumns, int column, int row) {
  return byColumns ? uint(row) * uint(params.lists.x) + uint(column)
                   : uint(column) * uint(params.lists.x) + uint(row);
}

// Weight of the second of two neighbouring lists, at a point between their centres; exactly 0 at the first
// one's centre, despite rounding. `beyond` is the distance from the first one's centre, in [0, 1).
float shareOfNext(float beyond) {
  const float onCentre = 1.0 / 256.0;
  return clamp((beyond - onCentre) / (1.0 - 2.0 * onCentre), 0.0, 1.0);
}

// Adds up the weighted intersections of a ray's two invocations.
Intersection ofBoth(Intersection own) {
  return Intersection(own.light + subgroupShuffleXor(own.light, 1u),
                      min(own.entered, subgroupShuffleXor(own.entered, 1u)));
}

// Intersects a ray that stays near one position of V_O's picture with the four lists around it.
Intersection intersectAlongLists(PictureLine line, vec2 stretch) {
  vec2 begin = pictureAt(ray, stretch.x) - 0.5;
  vec2 end = pictureAt(ray, stretch.y) - 0.5;
  vec2 place = 0.5 * (begin + end);
  vec2 first = floor(place);
  float shareX = shareOfNext(place.x - first.x);
  float shareY = shareOfNext(place.y - first.y);
  Intersection sum = nothing;
  for (uint i = rayLane; i < 4u; i += lanesPerRay) {
    ivec2 side = ivec2(i & 1u, i >> 1);
    float weight = (side.x == 0 ? 1.0 - shareX : shareX) * (side.y == 0 ? 1.0 - shareY : shareY);
    ivec2 pixel = clamp(ivec2(first) + side, ivec2(0), params.lists - 1);
    uint list = listOf(true, pixel.x, pixel.y);
    if (!(weight > 0.0) || !mayMeet(params.heads.at[list].mask, vec2(line.bins.x, at(line.bins, 1.0))))
      continue;
    Part part = partOf(line, vec2(0.0, 1.0), shorteningAt(vec2(pixel) + 0.5));
    part.begin = begin - vec2(pixel);
    part.end = end - vec2(pixel);
    Intersection intersection = intersectWholeList(list, part);
    sum.light += weight * intersection.light;
    sum.entered = min(sum.entered, intersection.entered);
  }
  return lanesPerRay == 1u ? sum : ofBoth(sum);
}

// A column that the ray crosses, and two of its lists: those beside the ray, or those where the ray enters
// and leaves the column.
struct Column {
  int column;
  vec2 edges;  // progress where the ray enters and leaves it
  vec2 fractions;
  ivec2 rows;
  float share;  // the second one's share
  uvec2 lists;
};

// `edges` are the line's progress, in columns, at the column's two edges.
Column columnAt(PictureLine line, int column, vec2 edges, vec2 fractions) {
  Column here;
  here.column = column;
  here.edges = vec2(min(edges.x, edges.y), max(edges.x, edges.y));
  here.fractions = vec2(min(fractions.x, fractions.y), max(fractions.x, fractions.y));
  ivec2 maxRow = ivec2(columnCount(!line.byColumns) - 1);
  if (smoothReconstruction) {
    float centre = line.row + 0.5 * (edges.x + edges.y) * line.rows - 0.5;
    float below = floor(centre);
    here.share = shareOfNext(centre - below);
    here.rows = clamp(int(below) + ivec2(0, 1), ivec2(0), maxRow);
  } else {
    here.rows = clamp(ivec2(floor(line.row + here.edges * line.rows)), ivec2(0), maxRow);
    // A diagonal through corners may touch a third list, but too little to intersect it.
    here.rows.x = clamp(here.rows.x, here.rows.y - 1, here.rows.y + 1);
    here.share = here.rows.x == here.rows.y ? 0.0 : 0.5;
  }
  here.lists =
      uvec2(listOf(line.byColumns, column, here.rows.x), listOf(line.byColumns, column, here.rows.y));
  return here;
}

// Number of columns to read at a time, which takes about as long as reading one: half a tile, because each of
// a ray's two invocations takes a part of the tile.
const int columnsAtOnce = 4;
// Bits in the result of listsToIntersect: a column's first and second list.
const uint firstListBit = 1u;
const uint secondListBit = 1u << renderTile;

// For the columns of a tile: bits firstListBit and secondListBit, shifted by c, tell whether the ray may meet
// material in column c's lists. Each of a ray's invocations finds its part.
uint listsToIntersect(PictureLine line, int tile) {
  const int part = renderTile / int(lanesPerRay);
  int maximum = columnCount(line.byColumns) - 1;
  int first = (tile << renderTileShift) + part * int(rayLane);
  uint listBits = 0u;
  float edge = columnsTo(line, float(first));
  float fraction = fractionAfter(line, edge);
  for (int begin = 0; begin < part; begin += columnsAtOnce) {
    [[unroll]] for (int i = 0; i < columnsAtOnce; ++i) {
      int column = first + begin + i;
      float nextEdge = columnsTo(line, float(column + 1));
      float nextFraction = fractionAfter(line, nextEdge);
      // Columns beyond the line's ends read an existing list, whose data is not used.
      Column here = columnAt(line, min(column, maximum), vec2(edge, nextEdge), vec2(fraction, nextFraction));
      uint64_t firstMask = params.heads.at[here.lists.x].mask;
      uint64_t secondMask = params.heads.at[here.lists.y].mask;
      vec2 bins = vec2(at(line.bins, fraction), at(line.bins, nextFraction));
      // Products, because && would branch: all masks are requested before the first one is awaited. If the
      // picture ends within a tile, rounding may let a line that leaves it reach a column outside.
      uint passes = uint(nextEdge != edge) * uint(column <= maximum);
      uint meetsFirst = passes * uint(here.share < 1.0) * uint(mayMeet(firstMask, bins));
      uint meetsSecond = passes * uint(here.share > 0.0) * uint(mayMeet(secondMask, bins));
      listBits |= (meetsFirst * firstListBit + meetsSecond * secondListBit) << (begin + i);
      edge = nextEdge;
      fraction = nextFraction;
    }
  }
  listBits <<= part * int(rayLane);
  return lanesPerRay == 1u ? listBits : listBits | subgroupShuffleXor(listBits, 1u);
}

// The line's shortening at the two edges of a tile; between them, it is nearly linear.
vec2 shorteningsAt(PictureLine line, int tile) {
  vec2 edges = vec2(tile, tile + 1) * float(renderTile);
  vec2 rows = line.row + line.rows * (edges - line.start) * line.direction;
  vec2 first = vec2(edges.x, rows.x);
  vec2 last = vec2(edges.y, rows.y);
  return vec2(shorteningAt(line.byColumns ? first : first.yx), shorteningAt(line.byColumns ? last : last.yx));
}

Intersection intersectSide(PictureLine line, Column here, float shortening, bool second, inout int hint) {
  vec2 fractions = here.fractions;
  if (!smoothReconstruction && here.rows.x != here.rows.y) {
    float edge = float(max(here.rows.x, here.rows.y));
    float split = fractionAfter(line, clamp((edge - line.row) / line.rows, 0.0, line.columns));
    split = clamp(split, fractions.x, fractions.y);
    fractions = second ? vec2(split, fractions.y) : vec2(fractions.x, split);
  }
  Part part = partOf(line, fractions, shortening);
  if (shearedReconstruction) {
    vec2 along = line.start + line.direction * here.edges - (float(here.column) + 0.5);
    vec2 across = line.row + line.rows * here.edges - (float(second ? here.rows.y : here.rows.x) + 0.5);
    part.begin = line.byColumns ? vec2(along.x, across.x) : vec2(across.x, along.x);
    part.end = line.byColumns ? vec2(along.y, across.y) : vec2(across.y, along.y);
  }
  Intersection intersection = intersectList(second ? here.lists.y : here.lists.x, part, hint);
  if (smoothReconstruction) intersection.light *= second ? here.share : 1.0 - here.share;
  return intersection;
}

// Intersects the ray with a column. `listBits` are firstListBit and secondListBit.
Intersection intersectColumn(PictureLine line, int column, float shortening, uint listBits,
                             inout ivec2 hints) {
  vec2 edges = vec2(columnsTo(line, float(column)), columnsTo(line, float(column + 1)));
  Column here =
      columnAt(line, column, edges, vec2(fractionAfter(line, edges.x), fractionAfter(line, edges.y)));
  Intersection own = nothing;
  if (lanesPerRay > 1u) {
    bool second = rayLane != 0u;
    if ((listBits & (second ? secondListBit : firstListBit)) != 0u)
      own = intersectSide(line, here, shortening, second, hints.x);
    if (smoothReconstruction) return ofBoth(own);
    // The first list is in front of the second one.
    float transmittance = subgroupShuffleXor(1.0 - own.light.a, 1u);
    if (second) own.light *= transmittance;
    return ofBoth(own);
  }
  if ((listBits & firstListBit) != 0u) own = intersectSide(line, here, shortening, false, hints.x);
  if ((listBits & secondListBit) != 0u) {
    Intersection other = intersectSide(line, here, shortening, true, hints.y);
    own.light += (smoothReconstruction ? 1.0 : 1.0 - own.light.a) * other.light;
    own.entered = min(own.entered, other.entered);
  }
  return own;
}

// Goes tile by tile: finds all lists to intersect, then intersects them, so that neighbouring rays do the
// same at the same time.
void traverse(PictureLine line) {
  bool up = line.direction > 0.0;
  int lastTile = line.last >> renderTileShift;
  ivec2 hints = ivec2(0);
  for (int tile = line.first >> renderTileShift;; tile += up ? 1 : -1) {
    tile = nextTile(line, tile, lastTile);
    if (tile < 0) return;
    uint listBits = listsToIntersect(line, tile);
    uint columns = (listBits | listBits / secondListBit) & (secondListBit - 1u);
    vec2 shortenings = shorteningsAt(line, tile);
    while (columns != 0u) {
      int i = up ? findLSB(columns) : findMSB(columns);
      columns &= ~(1u << i);
      float shortening = mix(shortenings.x, shortenings.y, (float(i) + 0.5) / float(renderTile));
      accumulate(intersectColumn(line, (tile << renderTileShift) + i, shortening, listBits >> i, hints));
      if (accumulated.light.a >= opaqueAcross) return;
    }
    if (tile == lastTile) return;
  }
}
