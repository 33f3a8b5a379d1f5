// What a part of a ray meets of a list.
//
// Needs: shared/render.h, line.glsl; params.

float stretchLength;  // of a ray's whole stretch, as depth of V_O's middle ray
bool rayAscends;      // it meets a list's supersegments in their order; else backwards

void beginLooking(PictureLine line, vec2 stretch) {
  stretchLength = (stretch.y - stretch.x) * length(ray.direction);
  rayAscends = line.depths.y >= 0.0;
}

// Of a list with that centre: depth for a length of its own ray.
float shortening(vec2 centre) {
  if (params.parallel != 0u) return 1.0;
  vec2 offset = (centre - 0.5 * vec2(params.lists)) * params.pixelSize;
  return inversesqrt(1.0 + dot(offset, offset));
}

struct Look {
  vec4 light;
  float entered;  // where something is met first: a fraction of the line
};

const Look nothing = Look(vec4(0.0), infinity);

// Between two fractions of the line; `list` has at least one supersegment. `hint`: where the last look at a neighbouring list
// started, counted as the ray meets them; lists are alike there.
Look lookAtList(PictureLine line, uint list, vec2 centre, vec2 fractions, inout int hint) {
  ListHead head = params.heads.at[list];
  RenderSegmentArray segments = params.segments;
  int last = int(head.count) - 1;
  int place = min(hint, last);
  int step = rayAscends ? 1 : -1;
  uint slot = head.first + uint(rayAscends ? place : last - place);
  RenderSegment piece = segments.at[slot];

  vec2 ends = vec2(lineDepth(line, fractions.x), lineDepth(line, fractions.y));
  float low = min(ends.x, ends.y);
  float high = max(max(ends.x, ends.y), low + 1e-6 * params.farthest);
  // How much longer the ray is between two depths than the list's own.
  float slant = (fractions.y - fractions.x) * stretchLength * shortening(centre) / (high - low);
  while (place > 0 && (rayAscends ? piece.front > low : piece.back < high)) {
    --place;
    slot -= uint(step);
    piece = segments.at[slot];
  }
  hint = place;

  vec3 light = vec3(0.0);
  float transmittance = 1.0;
  float entered = ends.x;
  for (;;) {
    float met = min(piece.back, high) - max(piece.front, low);
    if (met > 0.0) {
      if (transmittance == 1.0) entered = rayAscends ? max(piece.front, low) : min(piece.back, high);
      float behind = transmittance * exp2(-met * slant * piece.density);
      light += (transmittance - behind) * pieceColor(piece);
      transmittance = behind;
    }
    if ((rayAscends ? piece.back >= high : piece.front <= low) || place == last) break;
    ++place;
    slot += uint(step);
    piece = segments.at[slot];
    if (rayAscends ? piece.front <= low : piece.back >= high) hint = place;
  }
  if (transmittance == 1.0) return nothing;
  float share = clamp((entered - ends.x) / (rayAscends ? high - low : low - high), 0.0, 1.0);
  return Look(vec4(light * pieceColorUnit, 1.0 - transmittance), mix(fractions.x, fractions.y, share));
}
