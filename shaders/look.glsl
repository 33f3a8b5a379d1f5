// What a part of a ray meets of a list.
//
// Needs: shared/render.h, pieces.glsl, line.glsl; params.

bool rayAscends;  // it meets a list's supersegments in their order; else backwards
// How long the ray is for a change of depth, where that says something; else the length of its whole stretch.
float raySlant;

// Else a column's change of depth may be lost in rounding.
bool changesDepth(PictureLine line) { return line.depths.y > 0.01 * params.farthest; }

void beginLooking(PictureLine line, vec2 stretch) {
  rayAscends = line.bins.y >= 0.0;
  raySlant = (stretch.y - stretch.x) * length(ray.direction) / (changesDepth(line) ? line.depths.y : 1.0);
}

// At a place in V_O's picture: depth for a length of the ray that goes through it.
float shorteningAt(vec2 place) {
  if (params.parallel != 0u) return 1.0;
  vec2 offset = (place - 0.5 * vec2(params.lists)) * params.pixelSize;
  return inversesqrt(1.0 + dot(offset, offset));
}

// What a ray sees of something, and the depth that it's met at first, as PictureLine has depths.
struct Look {
  vec4 light;
  float entered;
};

const Look nothing = Look(vec4(0.0), infinity);

// Front and back, as the ray meets them.
vec2 metDepths(uvec4 piece) {
  vec2 depths = pieceDepths(piece);
  return rayAscends ? depths : -depths.yx;
}

// Between two fractions of the line; `list` has at least one supersegment. `hint`: where the last look at a neighbouring list
// ended, counted as the ray meets them; lists are alike there.
Look lookAtList(PictureLine line, uint list, vec2 fractions, float shortening, inout int hint) {
  ListHead head = params.heads.at[list];
  PieceArray pieces = params.segments;
  int last = int(head.count) - 1;
  int place = min(hint, last);
  int step = rayAscends ? 1 : -1;
  uint slot = head.first + uint(rayAscends ? place : last - place);
  uvec4 piece = pieces.at[slot];

  float low = at(line.depths, fractions.x);
  float high = at(line.depths, fractions.y);
  float slant = raySlant * shortening;  // how much longer the ray is between two depths than the list's own
  if (!changesDepth(line)) {
    high = max(high, low + 1e-6 * params.farthest);
    slant *= (fractions.y - fractions.x) / (high - low);
  }
  vec2 depths = metDepths(piece);
  while (place > 0 && depths.x > low) {
    --place;
    slot -= uint(step);
    piece = pieces.at[slot];
    depths = metDepths(piece);
  }
  // Not below, where each takes longer.
  while (place < last && depths.y <= low) {
    ++place;
    slot += uint(step);
    piece = pieces.at[slot];
    depths = metDepths(piece);
  }

  vec3 light = vec3(0.0);
  float transmittance = 1.0;
  float entered = infinity;
  for (;;) {
    float front = max(depths.x, low);
    float met = min(depths.y, high) - front;
    if (met > 0.0) {
      entered = min(entered, front);
      float behind = transmittance * exp2(-met * slant * pieceDensity(piece));
      light += (transmittance - behind) * pieceColor(piece);
      transmittance = behind;
    }
    if (depths.y >= high || place == last) break;
    ++place;
    slot += uint(step);
    piece = pieces.at[slot];
    depths = metDepths(piece);
  }
  hint = place;
  return Look(vec4(light * pieceColorUnit, 1.0 - transmittance), entered);
}
