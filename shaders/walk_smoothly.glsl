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
  uint mask;
};

BlendPart blendPart(vec2 t) { return BlendPart(t, maskBetween(depthAt(t.x), depthAt(t.y))); }

// `head`: the list's, if it has a share in the blend.
void blendList(ivec2 pixel, uvec2 head, float weight, BlendPart part, inout int hint) {
  if ((head.y & part.mask) == 0u || !(weight > 0.0)) return;
  lookAtList(pixel, head.x, params.heads.at[listOf(pixel) + 1u].x, part.t, hint);
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
    int hint = 0;
    blendList(pixel, params.heads.at[listOf(pixel)], weight, part, hint);
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
  int direction;   // 1 or -1, from column to column
  int ahead;       // 1 if columns ascend
  int mostAcross;  // the last row there is
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

// Where a walk along the line is.
struct ColumnWalk {
  int column;
  float enterS;  // where the line enters it
  int tile;
  int largeTile;
  uint tileRay;  // depths that the ray is in, in columns that start in the tile
};

int rowOf(ColumnLine line, ColumnWalk walk) {
  return clamp(int(floor(line.startAcross + walk.enterS * line.extentAcross)), 0, line.mostAcross);
}

int tileOf(ColumnLine line, int size, ColumnWalk walk) {
  int row = rowOf(line, walk);
  return tileIndex(size, line.byColumns ? ivec2(walk.column, row) : ivec2(row, walk.column));
}

float enterColumn(ColumnLine line, int column, float atLeast) {
  return clamp((float(column + 1 - line.ahead) - line.start) * line.inverse, atLeast, 1.0);
}

// Goes on to a tile with material along the ray, if it isn't in one; false if there's none. Columns that lie in a tile without
// are left out, those of a large tile at once. A tile's mask has its neighbours' outermost lists in it.
bool findTile(PictureLine picture, ColumnLine line, inout ColumnWalk walk) {
  for (;;) {
    int tile = tileOf(line, renderTile, walk);
    if (tile == walk.tile) return true;
    walk.tile = tile;
    int row = rowOf(line, walk);
    TileExit leave = tileExit(line, renderTile, walk.column, row, walk.enterS);
    walk.tileRay = rayBetween(picture, walk.enterS, min(leave.s + abs(line.inverse), 1.0));
    if ((params.tileMasks.at[tile] & walk.tileRay) != 0u) return true;
    int largeTile = tileOf(line, renderLargeTile, walk);
    if (largeTile != walk.largeTile) {
      walk.largeTile = largeTile;
      TileExit leaveLarge = tileExit(line, renderLargeTile, walk.column, row, walk.enterS);
      if ((params.tileMasks.at[largeTile] & rayBetween(picture, walk.enterS, leaveLarge.s)) == 0u) leave = leaveLarge;
    }
    if (leave.s >= 1.0) return false;
    if (leave.column == walk.column) return true;
    walk.column = leave.column;
    walk.enterS = enterColumn(line, walk.column, walk.enterS);
  }
}

// A column that the ray crosses: the two lists beside it, as pixels.
struct ColumnMeeting {
  float leaveS;
  float share;  // of next
  ivec2 near;
  ivec2 next;
  uvec2 nearHead;
  uvec2 nextHead;
  BlendPart part;  // of the ray; its mask is 0 where the column wasn't looked at
};
const ColumnMeeting noMeeting =
    ColumnMeeting(0.0, 0.0, ivec2(0), ivec2(0), uvec2(0u), uvec2(0u), BlendPart(vec2(0.0), 0u));

ColumnMeeting meetColumn(ColumnLine line, ColumnWalk walk) {
  ColumnMeeting meeting = noMeeting;
  meeting.leaveS =
      walk.column == line.lastColumn ? 1.0 : enterColumn(line, walk.column + line.direction, walk.enterS);
  float centre = line.startAcross + 0.5 * (walk.enterS + meeting.leaveS) * line.extentAcross - 0.5;
  meeting.share = shareOfNext(centre);
  int near = clamp(int(floor(centre)), 0, line.mostAcross);
  int next = clamp(int(floor(centre)) + 1, 0, line.mostAcross);
  meeting.near = line.byColumns ? ivec2(walk.column, near) : ivec2(near, walk.column);
  meeting.next = line.byColumns ? ivec2(walk.column, next) : ivec2(next, walk.column);
  meeting.nearHead = params.heads.at[listOf(meeting.near)];
  meeting.nextHead = params.heads.at[listOf(meeting.next)];
  return meeting;
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
  line.mostAcross = (line.byColumns ? lists.y : lists.x) - 1;
  int mostColumn = (line.byColumns ? lists.x : lists.y) - 1;
  int column = clamp(int(floor(line.start)), 0, mostColumn);
  line.lastColumn = clamp(int(floor(line.start + line.extent)), 0, mostColumn);
  line.direction = line.lastColumn > column ? 1 : -1;
  line.ahead = max(line.direction, 0);
  ColumnWalk walk = ColumnWalk(column, 0.0, -1, -1, 0u);
  float enterT = picture.t.x;  // where s is knownS
  float knownS = 0.0;
  int nearHint = 0;
  int nextHint = 0;
  // Rays look for tiles, then for columns, and then at lists: each in a loop of its own, so that those next to each other do
  // the same at a time. Every turn passes a column.
  while (findTile(picture, line, walk)) {
    ColumnMeeting meeting = noMeeting;
    for (;;) {
      ColumnMeeting here = meetColumn(line, walk);
      if (((here.nearHead.y | here.nextHead.y) & walk.tileRay) != 0u) {
        if (knownS != walk.enterS) enterT = tAt(picture, walk.enterS);
        here.part = blendPart(vec2(enterT, tAt(picture, here.leaveS)));
        enterT = here.part.t.y;
        knownS = here.leaveS;
        if (here.part.t.y > here.part.t.x && ((here.nearHead.y | here.nextHead.y) & here.part.mask) != 0u) {
          // Just what's assigned here may be used behind the loop: lavapipe (Mesa 22.3) gives a ray that has left a loop what
          // others compute in it later, but for values that differ from exit to exit.
          meeting = here;
          break;
        }
      }
      if (walk.column == line.lastColumn) return;
      walk.column += line.direction;
      walk.enterS = here.leaveS;
      if (tileOf(line, renderTile, walk) != walk.tile) break;
    }
    if (meeting.part.mask == 0u) continue;
    beginBlend();
    blendList(meeting.near, meeting.nearHead, 1.0 - meeting.share, meeting.part, nearHint);
    blendList(meeting.next, meeting.nextHead, meeting.share, meeting.part, nextHint);
    accumulate(blendLight, blendDepth);
    if (accumulated.a >= opaque || walk.column == line.lastColumn) return;
    walk.column += line.direction;
    walk.enterS = meeting.leaveS;
  }
}
