// Reconstruction::Smooth: columns of lists (or rows, whichever the ray crosses more of) one after the other, and of each the
// two lists beside the ray, blended. Twin of walkSmoothly in vdi/reference/Render.cpp.

// Several lists seen as one.
vec4 blendLight;
float blendDepth;

void beginBlend() {
  blendLight = vec4(0.0);
  blendDepth = uintBitsToFloat(0x7f800000u);
}

// The stretch of the ray that a blend is of.
struct BlendPart {
  vec2 t;
  vec2 depths;  // V_O's, in order
  uint mask;
};

BlendPart blendPart(vec2 t) {
  float a = depthAt(t.x);
  float b = depthAt(t.y);
  return BlendPart(t, vec2(min(a, b), max(a, b)), maskBetween(a, b));
}

// `head`: the list's, if it has a share in the blend.
void blendList(ivec2 pixel, uint list, uvec2 head, float weight, BlendPart part, inout uint hint) {
  if ((head.y & part.mask) == 0u || !(weight > 0.0)) return;
  lookAtList(pixel, head.x, params.heads.at[list + 1u].x, part.t, part.depths.x, part.depths.y, hint);
  blendLight += weight * listLight;
  blendDepth = min(blendDepth, listDepth);
}

// Of a point between the centres of two neighbouring lists: the other one's share, which is exactly 0 on the first one's
// centre even where rounding isn't. `place`: relative to centres.
float shareOfNext(float place) {
  const float onCentre = 1.0 / 256.0;
  return clamp((place - floor(place) - onCentre) / (1.0 - 2.0 * onCentre), 0.0, 1.0);
}

// A ray that stays in about one place of V_O's picture: the four lists around that.
void lookAlongLists(PictureLine line) {
  ivec2 lastList = params.lists - 1;
  vec2 place = 0.5 * (line.start + line.end) - 0.5;
  float shareX = shareOfNext(place.x);
  float shareY = shareOfNext(place.y);
  BlendPart part = blendPart(line.t);
  beginBlend();
  for (int i = 0; i < 4; ++i) {
    ivec2 side = ivec2(i & 1, i >> 1);
    float weight = (side.x == 0 ? 1.0 - shareX : shareX) * (side.y == 0 ? 1.0 - shareY : shareY);
    ivec2 pixel = clamp(ivec2(floor(place)) + side, ivec2(0), lastList);
    uint list = uint(pixel.y) * uint(params.lists.x) + uint(pixel.x);
    uint hint = 0u;
    blendList(pixel, list, params.heads.at[list], weight, part, hint);
  }
  accumulate(blendLight, blendDepth);
}

// The line as the walk sees it: along the axis that it crosses more of, "columns", and across it, "rows".
struct ColumnLine {
  bool byColumns;  // of lists; else columns are rows of these
  float start;
  float extent;
  float inverse;
  float startAcross;
  float extentAcross;
  float inverseAcross;
  int lastColumn;  // of the line
  int ahead;       // 1 if columns ascend
};

// Where the line leaves the tile of `size` columns and rows that it's in from `enterS` on, in `column` and `row`: s, at most
// 1, and the column.
struct TileExit {
  float s;
  int column;
};

TileExit tileExit(ColumnLine line, int size, int column, int row, float enterS) {
  int tile = column / size;
  bool ends = line.lastColumn / size == tile;
  int edge = (tile + line.ahead) * size;
  float sAlong = ends ? 1.0 : (float(edge) - line.start) * line.inverse;
  int edgeAcross = (row / size + (line.extentAcross > 0.0 ? 1 : 0)) * size;
  float sAcross = line.extentAcross == 0.0 ? 1.0 : (float(edgeAcross) - line.startAcross) * line.inverseAcross;
  float s = clamp(min(sAlong, sAcross), enterS, 1.0);
  int there = edge + line.ahead - 1;
  if (ends || sAcross < sAlong) {
    there = clamp(int(floor(line.start + s * line.extent)), max(tile * size, min(column, line.lastColumn)),
                  min(tile * size + size - 1, max(column, line.lastColumn)));
  }
  return TileExit(s, there);
}

int tileIndex(ColumnLine line, int size, int column, int row) {
  return tileIndex(size, line.byColumns ? ivec2(column, row) : ivec2(row, column));
}

void walkSmoothly(PictureLine picture) {
  ivec2 lists = params.lists;
  vec2 whole = picture.end - picture.start;
  if (max(abs(whole.x), abs(whole.y)) < 1.0) {
    lookAlongLists(picture);
    return;
  }
  ColumnLine line;
  line.byColumns = 1.001 * abs(whole.x) >= abs(whole.y);
  line.start = line.byColumns ? picture.start.x : picture.start.y;
  line.extent = line.byColumns ? whole.x : whole.y;
  line.inverse = line.byColumns ? picture.inverseDelta.x : picture.inverseDelta.y;
  line.startAcross = line.byColumns ? picture.start.y : picture.start.x;
  line.extentAcross = line.byColumns ? whole.y : whole.x;
  line.inverseAcross = line.byColumns ? picture.inverseDelta.y : picture.inverseDelta.x;
  int mostColumn = (line.byColumns ? lists.x : lists.y) - 1;
  int mostAcross = (line.byColumns ? lists.y : lists.x) - 1;
  int stride = line.byColumns ? 1 : lists.x;
  int strideAcross = line.byColumns ? lists.x : 1;
  int column = clamp(int(floor(line.start)), 0, mostColumn);
  line.lastColumn = clamp(int(floor(line.start + line.extent)), 0, mostColumn);
  int direction = line.lastColumn > column ? 1 : -1;
  line.ahead = max(direction, 0);
  float enterS = 0.0;
  float enterT = picture.t.x;  // where s is knownS
  float knownS = 0.0;
  int knownTile = -1;
  int knownLargeTile = -1;
  uint tileRay = 0u;  // depths that the ray is in, in columns that start in the tile
  uint nearHint = 0u;
  uint nextHint = 0u;
  // Every turn passes a column.
  int most = abs(line.lastColumn - column) + 1;
  for (int i = 0; i < most; ++i) {
    // Columns that lie in a tile without material along the ray are left out, those of a large tile at once. A tile's mask
    // has its neighbours' outermost lists in it.
    int row = clamp(int(floor(line.startAcross + enterS * line.extentAcross)), 0, mostAcross);
    int tile = tileIndex(line, renderTile, column, row);
    if (tile != knownTile) {
      knownTile = tile;
      TileExit leave = tileExit(line, renderTile, column, row, enterS);
      tileRay = rayBetween(picture, enterS, min(leave.s + abs(line.inverse), 1.0));
      bool passes = (params.tileMasks.at[tile] & tileRay) == 0u;
      int largeTile = tileIndex(line, renderLargeTile, column, row);
      if (passes && largeTile != knownLargeTile) {
        knownLargeTile = largeTile;
        TileExit leaveLarge = tileExit(line, renderLargeTile, column, row, enterS);
        if ((params.tileMasks.at[largeTile] & rayBetween(picture, enterS, leaveLarge.s)) == 0u) leave = leaveLarge;
      }
      if (passes && leave.s >= 1.0) return;
      if (passes && leave.column != column) {
        column = leave.column;
        enterS = clamp((float(column + 1 - line.ahead) - line.start) * line.inverse, enterS, 1.0);
        continue;
      }
    }
    float leaveS = column == line.lastColumn
                       ? 1.0
                       : clamp((float(column + line.ahead) - line.start) * line.inverse, enterS, 1.0);
    float centre = line.startAcross + 0.5 * (enterS + leaveS) * line.extentAcross - 0.5;
    float share = shareOfNext(centre);
    int near = clamp(int(floor(centre)), 0, mostAcross);
    int next = clamp(int(floor(centre)) + 1, 0, mostAcross);
    uint nearList = uint(column * stride + near * strideAcross);
    uint nextList = uint(column * stride + next * strideAcross);
    uvec2 nearHead = params.heads.at[nearList];
    uvec2 nextHead = params.heads.at[nextList];
    if (((nearHead.y | nextHead.y) & tileRay) != 0u) {
      if (knownS != enterS) enterT = tAt(picture, enterS);
      BlendPart part = blendPart(vec2(enterT, tAt(picture, leaveS)));
      if (part.t.y > part.t.x) {
        ivec2 nearPixel = line.byColumns ? ivec2(column, near) : ivec2(near, column);
        ivec2 nextPixel = line.byColumns ? ivec2(column, next) : ivec2(next, column);
        beginBlend();
        blendList(nearPixel, nearList, nearHead, 1.0 - share, part, nearHint);
        blendList(nextPixel, nextList, nextHead, share, part, nextHint);
        accumulate(blendLight, blendDepth);
        if (accumulated.a >= opaque) return;
      }
      enterT = part.t.y;
      knownS = leaveS;
    }
    if (column == line.lastColumn) return;
    column += direction;
    enterS = leaveS;
  }
}
