// Reconstruction::Constant: the lists that the ray crosses, one after the other. Twin of walkLists in
// vdi/reference/Render.cpp.

// Where the line crosses the edges between columns and between rows. Vectors are worked on as wholes here: lavapipe
// (Mesa 22.3) mixes up components that are worked on apart.
vec2 crossings(PictureLine line, ivec2 edges) { return (vec2(edges) - line.start) * line.inverseDelta; }

// Where the line leaves the tile of `size` x `size` lists that it's in from `enterS` on, in `pixel`: s, at most 1, and the
// list that it enters.
struct ListExit {
  float s;
  ivec2 pixel;
  bool ends;  // it doesn't leave the tile
};

ListExit listExit(PictureLine line, int size, ivec2 pixel, ivec2 last, ivec2 ahead, float enterS) {
  ivec2 tile = pixel / size;
  ivec2 edge = (tile + ahead) * size;
  bvec2 leaves = notEqual(last / size, tile);
  vec2 s = mix(vec2(1.0), crossings(line, edge), leaves);
  float leaveS = clamp(min(s.x, s.y), enterS, 1.0);
  bool stepX = leaves.x && (!leaves.y || s.x <= s.y);
  ivec2 lowest = max(tile * size, min(pixel, last));
  ivec2 highest = min(tile * size + size - 1, max(pixel, last));
  ivec2 there = clamp(ivec2(floor(mix(line.start, line.end, leaveS))), lowest, highest);
  return ListExit(leaveS, mix(there, edge + ahead - 1, bvec2(stepX, !stepX)), !leaves.x && !leaves.y);
}

// Where a walk along the line is.
struct ListWalk {
  ivec2 pixel;
  float enterS;  // where the line enters it
  int tile;
  int largeTile;
  uint tileRay;  // depths that the ray is in, in the tile
};

// Goes on to a tile with material along the ray, if it isn't in one; false if there's none. A tile without is left in one step,
// and so is a large one.
bool findTile(PictureLine line, ivec2 last, ivec2 ahead, inout ListWalk walk) {
  for (;;) {
    int tile = tileIndex(renderTile, walk.pixel);
    if (tile == walk.tile) return true;
    walk.tile = tile;
    ListExit leave = listExit(line, renderTile, walk.pixel, last, ahead, walk.enterS);
    walk.tileRay = rayBetween(line, walk.enterS, leave.s);
    if ((params.tileMasks.at[tile] & walk.tileRay) != 0u) return true;
    int largeTile = tileIndex(renderLargeTile, walk.pixel);
    if (largeTile != walk.largeTile) {
      walk.largeTile = largeTile;
      ListExit leaveLarge = listExit(line, renderLargeTile, walk.pixel, last, ahead, walk.enterS);
      if ((params.tileMasks.at[largeTile] & rayBetween(line, walk.enterS, leaveLarge.s)) == 0u) leave = leaveLarge;
    }
    if (leave.ends) return false;
    walk.pixel = leave.pixel;
    walk.enterS = leave.s;
  }
}

// A list that the ray crosses.
struct ListMeeting {
  float leaveS;
  ivec2 next;  // the list behind it; itself, if the line ends in it
  uvec2 head;
  vec2 part;  // of the ray, t
  bool found;
};

void walkLists(PictureLine line) {
  ivec2 lastList = params.lists - 1;
  ivec2 last = clamp(ivec2(floor(line.end)), ivec2(0), lastList);
  ListWalk walk = ListWalk(clamp(ivec2(floor(line.start)), ivec2(0), lastList), 0.0, -1, -1, 0u);
  ivec2 direction = sign(last - walk.pixel);
  ivec2 ahead = max(direction, ivec2(0));
  float enterT = line.t.x;  // where s is knownS
  float knownS = 0.0;
  int hint = 0;
  // As in walkSmoothly: tiles, then lists, then supersegments. Every turn passes a list.
  while (findTile(line, last, ahead, walk)) {
    ListMeeting meeting = ListMeeting(0.0, ivec2(0), uvec2(0u), vec2(0.0), false);
    for (;;) {
      bvec2 moves = notEqual(walk.pixel, last);
      vec2 s = mix(vec2(2.0), crossings(line, walk.pixel + ahead), moves);
      bool stepX = moves.x && s.x <= s.y;
      bool stepY = moves.y && !stepX;
      ivec2 pixel = walk.pixel + mix(ivec2(0), direction, bvec2(stepX, stepY));
      float leaveS = clamp(min(s.x, s.y), walk.enterS, 1.0);
      uvec2 head = params.heads.at[listOf(walk.pixel)];
      if ((head.y & walk.tileRay) != 0u) {
        if (knownS != walk.enterS) enterT = tAt(line, walk.enterS);
        vec2 part = vec2(enterT, tAt(line, leaveS));
        vec2 depths = vec2(depthAt(part.x), depthAt(part.y));
        enterT = part.y;
        knownS = leaveS;
        if (part.y > part.x && (head.y & maskBetween(depths.x, depths.y)) != 0u) {
          meeting = ListMeeting(leaveS, pixel, head, part, true);
          break;
        }
      }
      if (!(stepX || stepY)) return;
      walk.pixel = pixel;
      walk.enterS = leaveS;
      if (tileIndex(renderTile, walk.pixel) != walk.tile) break;
    }
    if (!meeting.found) continue;
    uint end = params.heads.at[listOf(walk.pixel) + 1u].x;
    lookAtList(walk.pixel, meeting.head.x, end, meeting.part, hint);
    accumulate(listLight, listDepth);
    if (accumulated.a >= opaque || meeting.next == walk.pixel) return;
    walk.pixel = meeting.next;
    walk.enterS = meeting.leaveS;
  }
}
