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

void walkLists(PictureLine line) {
  ivec2 lastList = params.lists - 1;
  ivec2 pixel = clamp(ivec2(floor(line.start)), ivec2(0), lastList);
  ivec2 last = clamp(ivec2(floor(line.end)), ivec2(0), lastList);
  ivec2 direction = sign(last - pixel);
  ivec2 ahead = max(direction, ivec2(0));
  float enterS = 0.0;
  float enterT = line.t.x;  // where s is knownS
  float knownS = 0.0;
  int knownTile = -1;
  int knownLargeTile = -1;
  uint hint = 0u;
  uint tileRay = 0u;  // depths that the ray is in, in the tile
  // At most one step per column and row.
  int most = abs(last.x - pixel.x) + abs(last.y - pixel.y) + 1;
  for (int i = 0; i < most; ++i) {
    int tile = tileIndex(renderTile, pixel);
    if (tile != knownTile) {
      // A tile without material along the ray is left in one step, and so is a large one.
      knownTile = tile;
      ListExit leave = listExit(line, renderTile, pixel, last, ahead, enterS);
      tileRay = rayBetween(line, enterS, leave.s);
      if ((params.tileMasks.at[tile] & tileRay) == 0u) {
        int largeTile = tileIndex(renderLargeTile, pixel);
        if (largeTile != knownLargeTile) {
          knownLargeTile = largeTile;
          ListExit leaveLarge = listExit(line, renderLargeTile, pixel, last, ahead, enterS);
          if ((params.tileMasks.at[largeTile] & rayBetween(line, enterS, leaveLarge.s)) == 0u) leave = leaveLarge;
        }
        if (leave.ends) return;
        pixel = leave.pixel;
        enterS = leave.s;
        continue;
      }
    }
    bvec2 moves = notEqual(pixel, last);
    vec2 s = mix(vec2(2.0), crossings(line, pixel + ahead), moves);
    bool stepX = moves.x && s.x <= s.y;
    bool stepY = moves.y && !stepX;
    float leaveS = clamp(min(s.x, s.y), enterS, 1.0);
    uint list = uint(pixel.y) * uint(params.lists.x) + uint(pixel.x);
    uvec2 head = params.heads.at[list];
    if ((head.y & tileRay) != 0u) {
      if (knownS != enterS) enterT = tAt(line, enterS);
      vec2 part = vec2(enterT, tAt(line, leaveS));
      float a = depthAt(part.x);
      float b = depthAt(part.y);
      if (part.y > part.x && (head.y & maskBetween(a, b)) != 0u) {
        lookAtList(pixel, head.x, params.heads.at[list + 1u].x, part, min(a, b), max(a, b), hint);
        accumulate(listLight, listDepth);
        if (accumulated.a >= opaque) return;
      }
      enterT = part.y;
      knownS = leaveS;
    }
    if (!(stepX || stepY)) return;
    pixel += mix(ivec2(0), direction, bvec2(stepX, stepY));
    enterS = leaveS;
  }
}
