// What a stretch of a ray meets of a list.
//
// Needs: shared/render.h, optical.glsl, pieces.glsl; params, ray.

float rayWorldPerT;
bool rayAscends;  // it meets a list's supersegments in their order; else backwards
// t = tFirst + tPerPlace * a supersegment's place (pieces.glsl).
float tFirst;
float tPerPlace;

void beginLooking() {
  rayWorldPerT = length(ray.direction);
  // Across V_O's depths: all of a supersegment's are met at once, or none.
  float perDepth = 1.0 / (abs(ray.direction.z) < 1e-20 ? 1e-20 : ray.direction.z);
  rayAscends = perDepth > 0.0;
  tFirst = (placeOrigin(params.form) - ray.origin.z) * perDepth;
  tPerPlace = placeUnit(params.form) * perDepth;
}

// Of a ray in a list with that centre: how many of a place's units of the list's own ray are as long as 1 of t.
float placesPerT(vec2 centre) {
  float perUnit = rayWorldPerT / placeUnit(params.form);
  if (params.parallel != 0u) return perUnit;
  vec2 offset = (centre - 0.5 * vec2(params.lists)) * params.pixelSize;
  return perUnit * inversesqrt(1.0 + dot(offset, offset));
}

// A supersegment of a list.
struct Piece {
  int at;     // from the list's first, as the ray meets them
  int count;  // of the list
  uint slot;  // in the compact array
  uvec4 packed;
};

void fetch(inout Piece piece) {
  RenderSegmentArray segments = params.segments;
  piece.packed = packedPiece(segments, piece.slot);
}

void goOn(inout Piece piece, int by) {
  piece.at += by;
  piece.slot += uint(rayAscends ? by : -by);
  fetch(piece);
}

// Of a list that has one. `hint`: where the last look at a neighbouring list started; lists are alike there.
Piece pieceOf(uint list, int hint) {
  ListHead head = params.heads.at[list];
  Piece piece;
  piece.count = int(head.count);
  piece.at = min(hint, piece.count - 1);
  piece.slot = head.first + uint(rayAscends ? piece.at : piece.count - 1 - piece.at);
  fetch(piece);
  return piece;
}

// Of one list.
vec4 listLight;
float listDepth;

// Where the ray enters and leaves a supersegment's depths: t.
vec2 pieceStretch(vec2 places) { return tFirst + tPerPlace * (rayAscends ? places : places.yx); }

// listLight and listDepth of what a stretch of the ray meets of the piece's list. Rays next to each other wait for the one that
// takes most turns: there's one loop for what's left behind and what's met.
void lookAtList(Piece piece, float perT, vec2 stretch, inout int hint) {
  listLight = vec4(0.0);
  listDepth = infinity;
  vec2 places = piecePlaces(piece.packed);
  vec2 t = pieceStretch(places);
  while (piece.at > 0 && t.x > stretch.x) {
    goOn(piece, -1);
    places = piecePlaces(piece.packed);
    t = pieceStretch(places);
  }
  hint = piece.at;
  while (t.x < stretch.y) {
    if (!(t.x > stretch.x)) hint = piece.at;
    float enter = max(stretch.x, t.x);
    float leave = min(stretch.y, t.y);
    if (enter < leave) {
      float share = (leave - enter) * perT / (places.y - places.x);
      float opacity = opacityOf(pieceOpticalDepth(piece.packed) * share);
      if (opacity > 0.0 && listLight.a == 0.0) listDepth = enter;
      listLight += (1.0 - listLight.a) * opacity * vec4(pieceColor(piece.packed), 1.0);
    }
    if (piece.at + 1 == piece.count) return;
    goOn(piece, 1);
    places = piecePlaces(piece.packed);
    t = pieceStretch(places);
  }
}
