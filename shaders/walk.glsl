// A ray from column to column of V_O's picture. Reconstruction::Smooth blends the two lists of each that are beside the ray;
// Reconstruction::Constant looks at those that it crosses, one or two of each. Twin of walkSmoothly and walkLists in
// vdi/reference/Render.cpp.
//
// Needs: marks.glsl, line.glsl, look.glsl; params, smoothReconstruction, rayShares, rayShare, accumulate.

uint listOf(bool byColumns, int column, int row) {
  return byColumns ? uint(row) * uint(params.lists.x) + uint(column) : uint(column) * uint(params.lists.x) + uint(row);
}

// Of a point between the centres of two neighbouring lists: the other one's share, which is exactly 0 on the first one's
// centre even where rounding isn't. `beyond`: the first one's centre, in [0, 1).
float shareOfNext(float beyond) {
  const float onCentre = 1.0 / 256.0;
  return clamp((beyond - onCentre) / (1.0 - 2.0 * onCentre), 0.0, 1.0);
}

// Whether a list may have material between two depths, in any order.
bool mayMeet(uint64_t mask, vec2 depths) {
  const float spare = 0.01;  // for rounding
  vec2 bins = (depths - params.nearest) * params.binScale;
  int low = int(clamp(min(bins.x, bins.y) - spare, 0.0, float(renderBins - 1)));
  int high = int(clamp(max(bins.x, bins.y) + spare, 0.0, float(renderBins - 1)));
  uvec2 from = unpackUint2x32(mask >> low);
  int more = high - low;
  return ((more < 32 ? from.x : from.x | from.y) & (~0u >> (31 - min(more, 31)))) != 0u;
}

// What the other one of a ray's two invocations has seen.
Look fromOther(Look own) { return Look(subgroupShuffleXor(own.light, 1u), subgroupShuffleXor(own.entered, 1u)); }

// A ray that stays in about one place of V_O's picture: the four lists around that.
Look lookAlongLists(PictureLine line, vec2 stretch) {
  vec2 place = 0.5 * (pictureAt(ray, stretch.x) + pictureAt(ray, stretch.y)) - 0.5;
  vec2 first = floor(place);
  float shareX = shareOfNext(place.x - first.x);
  float shareY = shareOfNext(place.y - first.y);
  Look sum = nothing;
  for (uint i = rayShare; i < 4u; i += rayShares) {
    ivec2 side = ivec2(i & 1u, i >> 1);
    float weight = (side.x == 0 ? 1.0 - shareX : shareX) * (side.y == 0 ? 1.0 - shareY : shareY);
    ivec2 pixel = clamp(ivec2(first) + side, ivec2(0), params.lists - 1);
    uint list = listOf(true, pixel.x, pixel.y);
    vec2 depths = vec2(line.depths.x, lineDepth(line, 1.0));
    if (!(weight > 0.0) || !mayMeet(params.heads.at[list].mask, depths)) continue;
    int hint = 0;
    Look look = lookAtList(line, list, vec2(pixel) + 0.5, vec2(0.0, 1.0), hint);
    sum.light += weight * look.light;
    sum.entered = min(sum.entered, look.entered);
  }
  if (rayShares == 1u) return sum;
  Look other = fromOther(sum);
  return Look(sum.light + other.light, min(sum.entered, other.entered));
}

// A column that the ray crosses, and two lists of it: those beside the ray, or those that it enters and leaves the column in.
struct Column {
  vec2 fractions;
  ivec2 rows;
  float share;  // of the second one
  uvec2 lists;
};

// `edges`: how many columns after its start the line is at either one.
Column columnAt(PictureLine line, int column, vec2 edges, vec2 fractions) {
  Column here;
  here.fractions = vec2(min(fractions.x, fractions.y), max(fractions.x, fractions.y));
  ivec2 mostRow = ivec2(columnCount(!line.byColumns) - 1);
  if (smoothReconstruction) {
    float centre = line.row + 0.5 * (edges.x + edges.y) * line.rows - 0.5;
    float below = floor(centre);
    here.share = shareOfNext(centre - below);
    here.rows = clamp(int(below) + ivec2(0, 1), ivec2(0), mostRow);
  } else {
    vec2 inOut = vec2(min(edges.x, edges.y), max(edges.x, edges.y));
    here.rows = clamp(ivec2(floor(line.row + inOut * line.rows)), ivec2(0), mostRow);
    // A diagonal through corners may touch a third one: not enough to look at.
    here.rows.x = clamp(here.rows.x, here.rows.y - 1, here.rows.y + 1);
    here.share = here.rows.x == here.rows.y ? 0.0 : 0.5;
  }
  here.lists = uvec2(listOf(line.byColumns, column, here.rows.x), listOf(line.byColumns, column, here.rows.y));
  return here;
}

// Memory takes about as long for several as for one.
const int columnsAtOnce = 4;
// Bits of what columnsToLookAt returns: a column's first and second list.
const uint firstLook = 1u;
const uint secondLook = 1u << renderTile;

// Of the columns of a tile: bits firstLook and secondLook, shifted by c, tell whether the ray may meet something in column c's
// lists. Each of a ray's invocations finds its part.
uint columnsToLookAt(PictureLine line, int tile) {
  const int part = renderTile / int(rayShares);
  const int atOnce = min(part, columnsAtOnce);
  int most = columnCount(line.byColumns) - 1;
  int first = (tile << renderTileShift) + part * int(rayShare);
  uint looks = 0u;
  float edge = columnsTo(line, float(first));
  float fraction = fractionAfter(line, edge);
  for (int begin = 0; begin < part; begin += atOnce) {
    bool looksAt[2 * columnsAtOnce];
    [[unroll]] for (int i = 0; i < columnsAtOnce; ++i) {
      if (i >= atOnce) break;
      int column = first + begin + i;
      float nextEdge = columnsTo(line, float(column + 1));
      float nextFraction = fractionAfter(line, nextEdge);
      // Columns beyond the line's ends: memory is read where there's a list, and what's read isn't used.
      Column here = columnAt(line, min(column, most), vec2(edge, nextEdge), vec2(fraction, nextFraction));
      bool passes = nextEdge != edge;
      vec2 depths = vec2(lineDepth(line, fraction), lineDepth(line, nextFraction));
      looksAt[2 * i] = passes && here.share < 1.0 && mayMeet(params.heads.at[here.lists.x].mask, depths);
      looksAt[2 * i + 1] = passes && here.share > 0.0 && mayMeet(params.heads.at[here.lists.y].mask, depths);
      edge = nextEdge;
      fraction = nextFraction;
    }
    [[unroll]] for (int i = 0; i < columnsAtOnce; ++i) {
      if (i >= atOnce) break;
      looks |= ((looksAt[2 * i] ? firstLook : 0u) | (looksAt[2 * i + 1] ? secondLook : 0u)) << (begin + i);
    }
  }
  looks <<= part * int(rayShare);
  return rayShares == 1u ? looks : looks | subgroupShuffleXor(looks, 1u);
}

Look lookAtSide(PictureLine line, int column, Column here, bool second, inout int hint) {
  vec2 fractions = here.fractions;
  if (!smoothReconstruction && here.rows.x != here.rows.y) {
    float edge = float(max(here.rows.x, here.rows.y));
    float split = fractionAfter(line, clamp((edge - line.row) / line.rows, 0.0, line.columns));
    split = clamp(split, fractions.x, fractions.y);
    fractions = second ? vec2(split, fractions.y) : vec2(fractions.x, split);
  }
  vec2 centre = vec2(column, second ? here.rows.y : here.rows.x) + 0.5;
  return lookAtList(line, second ? here.lists.y : here.lists.x, line.byColumns ? centre : centre.yx, fractions,
                    hint);
}

// What the ray meets of a column. `looks`: firstLook, secondLook.
Look lookAtColumn(PictureLine line, int column, uint looks, inout ivec2 hints) {
  vec2 edges = vec2(columnsTo(line, float(column)), columnsTo(line, float(column + 1)));
  Column here = columnAt(line, column, edges, vec2(fractionAfter(line, edges.x), fractionAfter(line, edges.y)));
  Look first = nothing;
  Look second = nothing;
  if (rayShares == 1u) {
    if ((looks & firstLook) != 0u) first = lookAtSide(line, column, here, false, hints.x);
    if ((looks & secondLook) != 0u) second = lookAtSide(line, column, here, true, hints.y);
  } else {
    bool ownSide = (rayShare & 1u) != 0u;
    Look own = nothing;
    if ((looks & (ownSide ? secondLook : firstLook)) != 0u) own = lookAtSide(line, column, here, ownSide, hints.x);
    Look other = fromOther(own);
    if (ownSide) {
      first = other;
      second = own;
    } else {
      first = own;
      second = other;
    }
  }
  if (smoothReconstruction) {
    return Look(mix(first.light, second.light, here.share), min(first.entered, second.entered));
  }
  return Look(first.light + (1.0 - first.light.a) * second.light, first.light.a > 0.0 ? first.entered : second.entered);
}

// Tile by tile: first all that there's to look at is found, then looked at, so that rays next to each other do the same at a
// time.
void walk(PictureLine line) {
  bool up = line.direction > 0.0;
  int lastTile = line.last >> renderTileShift;
  ivec2 hints = ivec2(0);
  for (int tile = line.first >> renderTileShift;; tile += up ? 1 : -1) {
    tile = nextTile(line, tile, lastTile);
    if (tile < 0) return;
    uint looks = columnsToLookAt(line, tile);
    uint columns = (looks | looks / secondLook) & (secondLook - 1u);
    while (columns != 0u) {
      int i = up ? findLSB(columns) : findMSB(columns);
      columns &= ~(1u << i);
      accumulate(lookAtColumn(line, (tile << renderTileShift) + i, looks >> i, hints));
      if (accumulated.light.a >= opaque) return;
    }
    if (tile == lastTile) return;
  }
}
