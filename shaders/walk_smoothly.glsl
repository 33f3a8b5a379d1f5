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
  lookAtList(pixel, head.x, push.params.value.heads.at[list + 1u].x, part.t, part.depths.x, part.depths.y, hint);
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
  ivec2 lastList = push.params.value.lists - 1;
  vec2 place = 0.5 * (line.start + line.end) - 0.5;
  float shareX = shareOfNext(place.x);
  float shareY = shareOfNext(place.y);
  BlendPart part = blendPart(line.t);
  beginBlend();
  for (int i = 0; i < 4; ++i) {
    ivec2 side = ivec2(i & 1, i >> 1);
    float weight = (side.x == 0 ? 1.0 - shareX : shareX) * (side.y == 0 ? 1.0 - shareY : shareY);
    ivec2 pixel = clamp(ivec2(floor(place)) + side, ivec2(0), lastList);
    uint list = uint(pixel.y) * uint(push.params.value.lists.x) + uint(pixel.x);
    uint hint = 0u;
    blendList(pixel, list, push.params.value.heads.at[list], weight, part, hint);
  }
  accumulate(blendLight, blendDepth);
}

void walkSmoothly(PictureLine line) {
  ivec2 lists = push.params.value.lists;
  vec2 whole = line.end - line.start;
  if (max(abs(whole.x), abs(whole.y)) < 1.0) {
    lookAlongLists(line);
    return;
  }
  bool byColumns = 1.001 * abs(whole.x) >= abs(whole.y);
  float start = byColumns ? line.start.x : line.start.y;
  float extent = byColumns ? whole.x : whole.y;
  float inverse = byColumns ? line.inverseDelta.x : line.inverseDelta.y;
  float startAcross = byColumns ? line.start.y : line.start.x;
  float inverseAcross = byColumns ? line.inverseDelta.y : line.inverseDelta.x;
  float extentAcross = byColumns ? whole.y : whole.x;
  int lastColumn = (byColumns ? lists.x : lists.y) - 1;
  int lastAcross = (byColumns ? lists.y : lists.x) - 1;
  int stride = byColumns ? 1 : lists.x;
  int strideAcross = byColumns ? lists.x : 1;
  int tilesAcross = (lists.x + renderTile - 1) / renderTile;
  int column = clamp(int(floor(start)), 0, lastColumn);
  int last = clamp(int(floor(start + extent)), 0, lastColumn);
  int direction = last > column ? 1 : -1;
  int ahead = max(direction, 0);
  int aheadAcross = extentAcross > 0.0 ? 1 : 0;
  float enterS = 0.0;
  float enterT = line.t.x;  // where s is knownS
  float knownS = 0.0;
  int knownTile = -1;
  uint tileRay = 0u;  // depths that the ray is in, in columns that start in the tile
  uint nearHint = 0u;
  uint nextHint = 0u;
  int most = abs(last - column) + 1;
  for (int i = 0; i < most; ++i) {
    int row = clamp(int(floor(startAcross + enterS * extentAcross)), 0, lastAcross);
    int tileAlong = column / renderTile;
    int tileRow = row / renderTile;
    int tile = byColumns ? tileRow * tilesAcross + tileAlong : tileAlong * tilesAcross + tileRow;
    if (tile != knownTile) {
      // Columns that lie in a tile without material along the ray are left out. A tile's mask has its neighbours' outermost
      // lists in it.
      knownTile = tile;
      bool ends = last / renderTile == tileAlong;
      int edge = (tileAlong + ahead) * renderTile;
      float sAlong = ends ? 1.0 : (float(edge) - start) * inverse;
      float edgeAcross = float((tileRow + aheadAcross) * renderTile);
      float sAcross = extentAcross == 0.0 ? 1.0 : (edgeAcross - startAcross) * inverseAcross;
      float leaveS = clamp(min(sAlong, sAcross), enterS, 1.0);
      tileRay = maskBetween(depthAt(tAt(line, enterS)), depthAt(tAt(line, min(leaveS + abs(inverse), 1.0))));
      if ((push.params.value.tileMasks.at[tile] & tileRay) == 0u) {
        if (leaveS >= 1.0) return;
        int there = edge + ahead - 1;
        if (ends || sAcross < sAlong) {
          there = clamp(int(floor(start + leaveS * extent)), max(tileAlong * renderTile, min(column, last)),
                        min(tileAlong * renderTile + renderTile - 1, max(column, last)));
        }
        if (there != column) {
          column = there;
          enterS = clamp((float(column + 1 - ahead) - start) * inverse, enterS, 1.0);
          continue;
        }
      }
    }
    float leaveS = column == last ? 1.0 : clamp((float(column + ahead) - start) * inverse, enterS, 1.0);
    float centre = startAcross + 0.5 * (enterS + leaveS) * extentAcross - 0.5;
    float share = shareOfNext(centre);
    int near = clamp(int(floor(centre)), 0, lastAcross);
    int next = clamp(int(floor(centre)) + 1, 0, lastAcross);
    uint nearList = uint(column * stride + near * strideAcross);
    uint nextList = uint(column * stride + next * strideAcross);
    uvec2 nearHead = push.params.value.heads.at[nearList];
    uvec2 nextHead = push.params.value.heads.at[nextList];
    if (((nearHead.y | nextHead.y) & tileRay) != 0u) {
      if (knownS != enterS) enterT = tAt(line, enterS);
      BlendPart part = blendPart(vec2(enterT, tAt(line, leaveS)));
      if (part.t.y > part.t.x) {
        ivec2 nearPixel = byColumns ? ivec2(column, near) : ivec2(near, column);
        ivec2 nextPixel = byColumns ? ivec2(column, next) : ivec2(next, column);
        beginBlend();
        blendList(nearPixel, nearList, nearHead, 1.0 - share, part, nearHint);
        blendList(nextPixel, nextList, nextHead, share, part, nextHint);
        accumulate(blendLight, blendDepth);
        if (accumulated.a >= opaque) return;
      }
      enterT = part.t.y;
      knownS = leaveS;
    }
    if (column == last) return;
    column += direction;
    enterS = leaveS;
  }
}
