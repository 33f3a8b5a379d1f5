// Intersects a part of a ray with a list.
//
// Needs: shared/render.h, render_segment.glsl, line.glsl; params, opaque, segmentsAtOnce, maxSegmentsAtOnce.

bool rayAscends;  // whether the ray meets a list's supersegments in their order; else backwards
// Length of the ray per change of depth, if depth changes enough; else the length of its whole stretch.
float raySlant;

// Whether a column's change of depth is not lost in rounding.
bool changesDepth(PictureLine line) { return line.depths.y > 0.01 * params.farthest; }

void beginIntersecting(PictureLine line, vec2 stretch) {
  rayAscends = line.bins.y >= 0.0;
  raySlant = (stretch.y - stretch.x) * length(ray.direction) / (changesDepth(line) ? line.depths.y : 1.0);
}

// Depth per length of the ray that passes through a position in V_O's picture.
float shorteningAt(vec2 place) {
  if (params.parallel != 0u) return 1.0;
  vec2 offset = (place - 0.5 * vec2(params.lists)) * params.pixelSize;
  return inversesqrt(1.0 + dot(offset, offset));
}

// What a ray accumulates in an intersection, and the depth where it enters, as depths in PictureLine.
struct Intersection {
  vec4 light;
  float entered;
};

const Intersection nothing = Intersection(vec4(0.0), infinity);

// Depths of a supersegment's two ends in the order in which the ray meets them.
vec2 metDepths(uvec4 segment) {
  vec2 depths = segmentDepths(segment);
  return rayAscends ? depths : -depths.yx;
}

// A part of a ray, relative to a list.
struct Part {
  float low;  // depths
  float high;
  float slant;  // length of the ray relative to the list's own, between two depths
};

// The part between two fractions of the line.
Part partOf(PictureLine line, vec2 fractions, float shortening) {
  Part part = Part(at(line.depths, fractions.x), at(line.depths, fractions.y), raySlant * shortening);
  if (!changesDepth(line)) {
    part.high = max(part.high, part.low + 1e-6 * params.farthest);
    part.slant *= (fractions.y - fractions.x) / (part.high - part.low);
  }
  return part;
}

// The ray's accumulation within a list so far.
struct Seen {
  vec3 light;  // in units of segmentColorUnit
  float transmittance;
  float entered;
};

const Seen nothingYet = Seen(vec3(0.0), 1.0, infinity);

void meet(inout Seen seen, uvec4 segment, vec2 depths, Part part) {
  float front = max(depths.x, part.low);
  float met = min(depths.y, part.high) - front;
  if (met > 0.0) {
    seen.entered = min(seen.entered, front);
    float behind = seen.transmittance * exp2(-met * part.slant * segmentDensity(segment));
    seen.light += (seen.transmittance - behind) * segmentColor(segment);
    seen.transmittance = behind;
  }
}

Intersection intersectionOf(Seen seen)
    { return Intersection(vec4(seen.light * segmentColorUnit, 1.0 - seen.transmittance), seen.entered); }

RenderSegmentWords listSegments;  // of the current list

// The i-th of several supersegments from a slot on, of which `more` follow in the list; beyond these, the
// last one again.
uvec4 segmentFrom(uint slot, int i, int more, int step) {
  return listSegments.at[slot + uint(i == 0 ? 0 : min(i, more) * step)];
}

// An intersection's position in a list: at segmentsAtOnce supersegments.
struct Cursor {
  int place;  // index of the first of them, in the order in which the ray meets them
  uint slot;  // its slot in the list
  uvec4 segments[maxSegmentsAtOnce];
};

Cursor cursorAt(int place, uint slot, int last, int step) {
  Cursor at;
  at.place = place;
  at.slot = slot;
  [[unroll]] for (int i = 0; i < maxSegmentsAtOnce; ++i) {
    if (i < segmentsAtOnce) at.segments[i] = segmentFrom(slot, i, last - place, step);
  }
  return at;
}

// `list` must have at least one supersegment. `hint` is the index where the last intersection with a
// neighbouring list ended, in the order in which the ray meets them, because neighbouring lists are similar.
Intersection intersectList(uint list, Part part, inout int hint) {
  ListHead head = params.heads.at[list];
  listSegments = segmentWordsFrom(params.segments, head.first);
  int last = int(head.count) - 1;
  int place = min(hint, last);
  int step = rayAscends ? 1 : -1;
  Cursor at = cursorAt(place, uint(rayAscends ? place : last - place), last, step);
  while (at.place > 0 && metDepths(at.segments[0]).x > part.low) {
    int back = segmentsAtOnce == 1 ? 1 : min(at.place, segmentsAtOnce);
    at = cursorAt(at.place - back, at.slot - uint(back * step), last, step);
  }
  // Not in the loop below, where each step takes longer.
  while (at.place + segmentsAtOnce <= last && metDepths(at.segments[segmentsAtOnce - 1]).y <= part.low) {
    at = cursorAt(at.place + segmentsAtOnce, at.slot + uint(segmentsAtOnce * step), last, step);
  }
  Seen seen = nothingYet;
  for (;;) {
    [[unroll]] for (int i = 0; i < maxSegmentsAtOnce; ++i) {
      if (i == 0 || (i < segmentsAtOnce && at.place + i <= last))
        meet(seen, at.segments[i], metDepths(at.segments[i]), part);
    }
    bool isPast = metDepths(at.segments[segmentsAtOnce - 1]).y >= part.high;
    bool isLast = at.place + segmentsAtOnce > last;
    if (isPast || isLast) break;  // named, because || of expressions would branch twice
    at = cursorAt(at.place + segmentsAtOnce, at.slot + uint(segmentsAtOnce * step), last, step);
  }
  hint = at.place;
  return intersectionOf(seen);
}

// Intersection with a part that covers most of a list: reading several supersegments takes about as long as
// one.
Intersection intersectWholeList(uint list, Part part) {
  const int atOnce = 4;
  ListHead head = params.heads.at[list];
  listSegments = segmentWordsFrom(params.segments, head.first);
  int last = int(head.count) - 1;
  int step = rayAscends ? 1 : -1;
  uint slot = uint(rayAscends ? 0 : last);
  Seen seen = nothingYet;
  for (int place = 0; place <= last && seen.transmittance > 1.0 - opaque; place += atOnce) {
    uvec4 several[atOnce];
    [[unroll]] for (int i = 0; i < atOnce; ++i) several[i] = segmentFrom(slot, i, last - place, step);
    [[unroll]] for (int i = 0; i < atOnce; ++i) {
      if (place + i <= last) meet(seen, several[i], metDepths(several[i]), part);
    }
    slot += uint(atOnce * step);
  }
  return intersectionOf(seen);
}
