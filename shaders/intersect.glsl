// Intersects a part of a ray with a list.
//
// Needs: shared/render.h, render_segment.glsl, line.glsl; params, opaque, segmentsAtOnce, maxSegmentsAtOnce,
// shearedReconstruction.

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

// The light that a ray accumulates in an intersection, and the depth where it enters, as depths in
// PictureLine.
struct Intersection {
  vec4 light;
  float entered;
};

const Intersection nothing = Intersection(vec4(0.0), infinity);

// A supersegment, and the slopes of its faces.
struct Leaning {
  uvec4 segment;
  uint slopes;
};

// Depths of a supersegment's two faces, front and back, in the order in which the ray meets them.
vec2 inMetOrder(vec2 depths) { return rayAscends ? depths : -depths.yx; }
// The two depths in the list's middle, in that order.
vec2 metDepths(Leaning of) { return inMetOrder(segmentDepths(of.segment)); }

// Depths of the faces at an offset from the list's centre. A face of the box ends the ray itself.
vec2 leaningDepths(Leaning of, vec4 slopes, vec2 offset) {
  vec4 change = slopes * params.slopeUnit;
  vec2 depths = segmentDepths(of.segment) + vec2(dot(change.xy, offset), dot(change.zw, offset));
  return vec2(frontIsOnFace(slopes) ? -infinity : depths.x, backIsOnFace(slopes) ? infinity : depths.y);
}

// A part of a ray, relative to a list.
struct Part {
  float low;  // depths
  float high;
  float slant;  // length of the ray relative to the list's own, between two depths
  // The part's ends in V_O's picture, relative to the list's centre; only for Reconstruction::Sheared.
  vec2 begin;
  vec2 end;
};

// The part between two fractions of the line.
Part partOf(PictureLine line, vec2 fractions, float shortening) {
  Part part = Part(at(line.depths, fractions.x), at(line.depths, fractions.y), raySlant * shortening,
                   vec2(0.0), vec2(0.0));
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

// Keeps the fractions of a part where a value that changes evenly is at least 0.
void keepWhere(vec2 value, inout vec2 fractions) {
  float crossing = value.x / (value.x - value.y);
  if (value.x < 0.0) fractions.x = value.y < 0.0 ? 2.0 : max(fractions.x, crossing);
  else if (value.y < 0.0) fractions.y = min(fractions.y, crossing);
}

void add(inout Seen seen, uvec4 segment, float front, float met, Part part) {
  seen.entered = min(seen.entered, front);
  float behind = seen.transmittance * exp2(-met * part.slant * segmentDensity(segment));
  seen.light += (seen.transmittance - behind) * segmentColor(segment);
  seen.transmittance = behind;
}

void meet(inout Seen seen, Leaning of, Part part) {
  if (shearedReconstruction) {
    vec4 slopes = segmentSlopes(of.slopes);
    vec2 begin = inMetOrder(leaningDepths(of, slopes, part.begin));
    vec2 end = inMetOrder(leaningDepths(of, slopes, part.end));
    vec2 fractions = vec2(0.0, 1.0);
    keepWhere(vec2(part.low - begin.x, part.high - end.x), fractions);
    keepWhere(vec2(begin.y - part.low, end.y - part.high), fractions);
    float length = part.high - part.low;
    if (fractions.x < fractions.y)
      add(seen, of.segment, part.low + fractions.x * length, (fractions.y - fractions.x) * length, part);
    return;
  }
  vec2 depths = metDepths(of);
  float front = max(depths.x, part.low);
  float met = min(depths.y, part.high) - front;
  if (met > 0.0) add(seen, of.segment, front, met, part);
}

Intersection intersectionOf(Seen seen)
    { return Intersection(vec4(seen.light * segmentColorUnit, 1.0 - seen.transmittance), seen.entered); }

RenderSegmentWords listSegments;  // supersegments of the current list
UintArray listSlopes;

// The i-th of several supersegments from a slot on, of which `more` follow in the list; beyond these, the
// last one again.
Leaning segmentFrom(uint slot, int i, int more, int step) {
  uint at = slot + uint(i == 0 ? 0 : min(i, more) * step);
  return Leaning(listSegments.at[at], shearedReconstruction ? listSlopes.at[at] : 0u);
}

// Prepares a list to be read. Returns the index of its last supersegment.
int useList(ListHead head) {
  listSegments = segmentWordsFrom(params.segments, head.first);
  listSlopes = uintsFrom(params.slopes, head.first);
  return int(segmentCount(head)) - 1;
}

// The distance by which the list's leaning faces reach beyond their depths in its middle.
float reachOf(ListHead head) {
  if (!shearedReconstruction) return 0.0;
  return float(head.countAndReach >> listCountBits) * (listReachUnit * params.slopeUnit);
}

// An intersection's position in a list: segmentsAtOnce adjacent supersegments.
struct Cursor {
  int place;  // index of the first of them, in the order in which the ray meets them
  uint slot;  // its slot in the list
  Leaning segments[maxSegmentsAtOnce];
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

// `list` must have at least one supersegment. The search starts at `hint`, the Cursor::place at which the
// last intersection with a neighbouring list ended, because neighbouring lists are similar.
Intersection intersectList(uint list, Part part, inout int hint) {
  ListHead head = params.heads.at[list];
  int last = useList(head);
  float low = part.low - reachOf(head);
  float high = part.high + reachOf(head);
  int place = min(hint, last);
  int step = rayAscends ? 1 : -1;
  Cursor at = cursorAt(place, uint(rayAscends ? place : last - place), last, step);
  while (at.place > 0 && metDepths(at.segments[0]).x > low) {
    int back = segmentsAtOnce == 1 ? 1 : min(at.place, segmentsAtOnce);
    at = cursorAt(at.place - back, at.slot - uint(back * step), last, step);
  }
  // Skips supersegments in front of the part here, because each step of the loop below takes longer.
  while (at.place + segmentsAtOnce <= last && metDepths(at.segments[segmentsAtOnce - 1]).y <= low) {
    at = cursorAt(at.place + segmentsAtOnce, at.slot + uint(segmentsAtOnce * step), last, step);
  }
  Seen seen = nothingYet;
  for (;;) {
    [[unroll]] for (int i = 0; i < maxSegmentsAtOnce; ++i) {
      if (i == 0 || (i < segmentsAtOnce && at.place + i <= last))
        meet(seen, at.segments[i], part);
    }
    bool isPast = metDepths(at.segments[segmentsAtOnce - 1]).y >= high;
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
  int last = useList(head);
  int step = rayAscends ? 1 : -1;
  uint slot = uint(rayAscends ? 0 : last);
  Seen seen = nothingYet;
  for (int place = 0; place <= last && seen.transmittance > 1.0 - opaque; place += atOnce) {
    Leaning several[atOnce];
    [[unroll]] for (int i = 0; i < atOnce; ++i) several[i] = segmentFrom(slot, i, last - place, step);
    [[unroll]] for (int i = 0; i < atOnce; ++i) {
      if (place + i <= last) meet(seen, several[i], part);
    }
    slot += uint(atOnce * step);
  }
  return intersectionOf(seen);
}
