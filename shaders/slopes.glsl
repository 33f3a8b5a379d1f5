// The slopes of supersegments' faces. Twin of vdi/reference/Slopes.cpp; its header states the rules.
//
// Needs: shared/render.h, optical.glsl, box_faces.glsl; push.

const float nowhere = 1.0 / 0.0;

// The width of V_O's pixels at the middle of the VDI's depths.
float footprintOf() {
  vec2 depths = vec2(uintBitsToFloat(push.depthRange.at[0]), uintBitsToFloat(push.depthRange.at[1]));
  return push.pixelSize * (push.perspective == 0u ? 1.0 : 0.5 * (depths.x + depths.y));
}

float segmentDepth(RenderSegment segment) {
  return min(segment.density * (segment.back - segment.front), renderMostDepth);
}

// Supersegments that touch each other: indices [first, last] of a list.
struct Run {
  uint first;
  uint last;
  float opticalDepth;
  float front;
  float back;
};

struct SlopeList {
  RenderSegmentArray segments;
  UintArray slopes;
  uint count;
};

SlopeList slopeListOf(ivec2 pixel) {
  if (any(lessThan(pixel, ivec2(0))) || any(greaterThanEqual(pixel, push.lists)))
    return SlopeList(push.segments, push.slopes, 0u);
  uint list = uint(pixel.y) * uint(push.lists.x) + uint(pixel.x);
  ListHead head = push.heads.at[list];
  return SlopeList(renderSegmentsFrom(push.segments, head.first), uintsFrom(push.slopes, head.first),
                   segmentCount(head));
}

Run runFrom(SlopeList list, uint first) {
  RenderSegment segment = list.segments.at[first];
  Run run = Run(first, first, segmentDepth(segment), segment.front, segment.back);
  while (run.last + 1u < list.count) {
    segment = list.segments.at[run.last + 1u];
    if (segment.front > run.back) break;
    ++run.last;
    run.opticalDepth += segmentDepth(segment);
    run.back = segment.back;
  }
  return run;
}

Run runBeside(SlopeList list, Run own, float footprint, inout uint from) {
  float reach = renderMaxSlope * footprint;
  Run best = Run(0u, 0u, -1.0, 0.0, 0.0);
  float most = -reach;
  for (uint first = from; first < list.count;) {
    Run run = runFrom(list, first);
    if (run.front >= own.back + reach) break;
    float overlap = min(own.back, run.back) - max(own.front, run.front);
    if (overlap > most + renderTie * footprint) {
      most = overlap;
      best = run;
    }
    first = run.last + 1u;
  }
  if (best.opticalDepth >= 0.0) from = best.first;
  return best;
}

// A walk along a run, to places of ascending optical depth.
struct Walk {
  uint at;
  float before;  // optical depth in front of it
};

float placeOf(SlopeList list, Run run, inout Walk walk, float opticalDepth) {
  RenderSegment segment = list.segments.at[walk.at];
  float own = segmentDepth(segment);
  while (walk.at < run.last && walk.before + own < opticalDepth) {
    walk.before += own;
    ++walk.at;
    segment = list.segments.at[walk.at];
    own = segmentDepth(segment);
  }
  float share = (opticalDepth - walk.before) / own;
  if (share > 1.001 || opticalDepth < -0.001 * own) return nowhere;
  return segment.front + (segment.back - segment.front) * clamp(share, 0.0, 1.0);
}

// A neighbour on one side of an axis: before the list, or after it.
struct SlopeNeighbour {
  SlopeList list;
  bool isAfter;
  float footprint;
};

int combined(int before, float depth, float place, SlopeNeighbour neighbour) {
  float change = neighbour.isAfter ? place - depth : depth - place;
  bool isKnown = abs(change) <= renderMaxSlope * neighbour.footprint;
  float unit = neighbour.footprint * (renderMaxSlope / renderSlopes);
  int slope = isKnown ? int(floor(change / unit + 0.5 + renderTie)) : renderNoSlope;
  if (!neighbour.isAfter || before == renderNoSlope) return slope;
  return isKnown ? (before + slope) / 2 : before;
}

// `shift` selects the axis's bits of a word of slopes: front x, front y, back x, back y, a byte each.
uint withCombined(uint word, int shift, float depth, float place, SlopeNeighbour neighbour) {
  int slope = combined(bitfieldExtract(int(word), shift, 8), depth, place, neighbour);
  return bitfieldInsert(word, uint(slope), shift, 8);
}

void addNeighbour(SlopeList list, SlopeNeighbour neighbour, int axis) {
  uint from = 0u;
  for (uint first = 0u; first < list.count;) {
    Run own = runFrom(list, first);
    Run other = runBeside(neighbour.list, own, neighbour.footprint, from);
    bool hasOther = other.opticalDepth >= 0.0;
    bool isFrontHalf = true;
    Walk walk = Walk(other.first, 0.0);
    float before = 0.0;
    float place = hasOther ? placeOf(neighbour.list, other, walk, 0.0) : nowhere;
    for (uint i = own.first; i <= own.last; ++i) {
      RenderSegment segment = list.segments.at[i];
      uint word = list.slopes.at[i];
      word = withCombined(word, 8 * axis, segment.front, place, neighbour);
      before += segmentDepth(segment);
      if (hasOther) {
        if (isFrontHalf && before > (0.5 + renderTie) * own.opticalDepth) {
          isFrontHalf = false;
          walk = Walk(other.first, 0.0);
        }
        float change = isFrontHalf ? 0.0 : other.opticalDepth - own.opticalDepth;
        place = placeOf(neighbour.list, other, walk, before + change);
      }
      list.slopes.at[i] =
          withCombined(word, 16 + 8 * axis, segment.back, place, neighbour);
    }
    first = own.last + 1u;
  }
}

uint withFaded(uint word, int shift, float opacity) {
  int slope = bitfieldExtract(int(word), shift, 8);
  float weight = clamp(opacity / renderLeastOpacity - 1.0, 0.0, 1.0);
  int faded = slope == renderNoSlope ? 0 : int(floor(float(slope) * weight + 0.5 + renderTie));
  return bitfieldInsert(word, uint(faded), shift, 8);
}

void fade(SlopeList list, float footprint) {
  float previous = 0.0;  // opacity of the supersegment that touches this one in front
  for (uint i = 0u; i < list.count; ++i) {
    RenderSegment segment = list.segments.at[i];
    float own = opacityOf(segment.density * footprint);
    float next = 0.0;
    if (i + 1u < list.count) {
      RenderSegment behind = list.segments.at[i + 1u];
      if (behind.front <= segment.back) next = opacityOf(behind.density * footprint);
    }
    uint word = list.slopes.at[i];
    word = withFaded(withFaded(word, 0, max(own, previous)), 8, max(own, previous));
    word = withFaded(withFaded(word, 16, max(own, next)), 24, max(own, next));
    list.slopes.at[i] = word;
    previous = next > 0.0 ? own : 0.0;
  }
}

// Marks the list's ends that lie on faces of the box.
void putOnFaces(SlopeList list, BoxPassage passage) {
  const uint onFace = uint(renderOnFace) & 0xffu;
  const uint bothOnFace = onFace | onFace << 8;
  uint last = list.count - 1u;
  if (isOnFace(list.segments.at[0].front, passage.enter)) {
    uint word = list.slopes.at[0];
    list.slopes.at[0] = bitfieldInsert(word, bothOnFace, 0, 16);
  }
  if (isOnFace(list.segments.at[last].back, passage.leave)) {
    uint word = list.slopes.at[last];
    list.slopes.at[last] = bitfieldInsert(word, bothOnFace, 16, 16);
  }
}

void findSlopes(ivec2 pixel) {
  SlopeList list = slopeListOf(pixel);
  float footprint = footprintOf();
  addNeighbour(list, SlopeNeighbour(slopeListOf(pixel - ivec2(1, 0)), false, footprint), 0);
  addNeighbour(list, SlopeNeighbour(slopeListOf(pixel + ivec2(1, 0)), true, footprint), 0);
  addNeighbour(list, SlopeNeighbour(slopeListOf(pixel - ivec2(0, 1)), false, footprint), 1);
  addNeighbour(list, SlopeNeighbour(slopeListOf(pixel + ivec2(0, 1)), true, footprint), 1);
  fade(list, footprint);
  if (list.count > 0u) putOnFaces(list, boxPassage(pixel));
}
