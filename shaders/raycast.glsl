// Casts one ray through the kd-tree of bricks, front to back, sample by sample.
//
// The program provides params, pages, slabs, pageCount, lanesPerRay, rayLane; useSample (below).
#ifndef VDI_RAYCAST_GLSL
#define VDI_RAYCAST_GLSL
#include "shared/cast.h"
#include "optical.glsl"

vec3 rayStart;
vec3 rayDirection;
float rayLengthOfDepth;  // world length of a unit of depth
float rayOpticalDepth;   // optical depth so far
uvec2 rayScene;          // samples [x, y) lie in the visible part: the scene's bounds, or a region of it
float rayEnter;          // depth where the ray enters the visible part, and where it leaves it
float rayLeave;
float rayBegin;  // rayEnter and rayLeave as places
float rayEnd;
// Distance from a sample's start to the point that decides its owner: 0.5, except for rays that graze the
// scene
float rayMiddle;

#include "slab.glsl"
#include "region.glsl"

void setUpRay(uint x, uint y) {
  float u = float(x) + 0.5 - 0.5 * float(params.width);
  float v = float(y) + 0.5 - 0.5 * float(params.height);
  precise vec3 start = params.startBase + u * params.startRight + v * params.startUp;
  precise vec3 direction =
      params.directionBase + u * params.directionRight + v * params.directionUp;
  rayStart = start;
  rayDirection = direction;
  rayLengthOfDepth = length(direction);
}

// A place on the ray counts samples: k is the start of sample k, k + 0.5 its middle. `precise` makes every
// rank and every pass find the same position for a place, because ownership depends on it.
vec3 positionAt(float place) {
  precise float depth = place * params.step;
  precise vec3 position = rayStart + depth * rayDirection;
  return position;
}

float middleOf(uint k) { return float(k) + rayMiddle; }

vec3 samplePosition(uint k) { return positionAt(middleOf(k)); }

bool contains(vec3 lo, vec3 hi, vec3 p) { return all(greaterThanEqual(p, lo)) && all(lessThan(p, hi)); }

// Samples [first, last) of the ray that the box owns. They form one range because each coordinate is monotone
// along the ray.
uvec2 samplesIn(vec3 lo, vec3 hi) {
  // Finds the part of the ray in the box, in units of samples and with a margin for rounding; then narrows it
  // sample by sample. Vectors are never indexed by a variable here: lavapipe (Mesa 22.3) mixes up the
  // components when lanes diverge.
  bvec3 across = equal(rayDirection, vec3(0.0));
  vec3 perSample = 1.0 / (rayDirection * params.step);
  vec3 a = (lo - rayStart) * perSample;
  vec3 b = (hi - rayStart) * perSample;
  vec3 spare = 2.0 + 1e-6 * max(abs(a), abs(b)) + abs(params.coordinateError * perSample);
  vec3 enters = mix(min(a, b) - spare, vec3(0.0), across);
  vec3 leaves = mix(max(a, b) + spare, vec3(params.sampleCount), across);
  float enter = max(max(enters.x, enters.y), max(enters.z, 0.0));
  float leave = min(min(leaves.x, leaves.y), min(leaves.z, float(params.sampleCount)));
  if (!(enter < leave)) return uvec2(0u);
  uint first = uint(enter);
  uint last = min(params.sampleCount, uint(ceil(leave)));
  while (first < last && !contains(lo, hi, samplePosition(first))) ++first;
  while (last > first && !contains(lo, hi, samplePosition(last - 1u))) --last;
  return uvec2(first, last);
}

// The bounds of the visible part (scene or region) seldom lie half-way between two samples. The outermost
// samples represent what is really there: the first one's interval starts where the ray enters, the last
// one's ends where it leaves. With whole samples, the faces of a filled box would show the sample lattice as
// stripes. The intervals depend only on ray, scene and region, so they are the same on every rank.
//
// If a ray leaves the bounds before it reaches the middle of any sample, the part between is one sample, and
// its middle decides its owner. Without this sample, the edges of a filled box would be jagged.
void setUpScene() {
  rayMiddle = 0.5;
  rayScene = samplesIn(params.sceneLo, params.sceneHi);
  bvec3 across = equal(rayDirection, vec3(0.0));
  float far = float(params.sampleCount) * params.step;
  precise vec3 a = (params.sceneLo - rayStart) / rayDirection;
  precise vec3 b = (params.sceneHi - rayStart) / rayDirection;
  vec3 enters = mix(min(a, b), vec3(0.0), across);
  vec3 leaves = mix(max(a, b), vec3(far), across);
  float enter = max(max(enters.x, enters.y), max(enters.z, 0.0));
  float leave = min(min(leaves.x, leaves.y), min(leaves.z, far));
  if (params.clipPlaneCount > 0u) {
    vec2 part = clipped(vec2(enter, leave));
    enter = part.x;
    leave = part.y;
    rayScene = clippedSamples(rayScene, part);
  }
  bool grazes = rayScene.x >= rayScene.y && enter < leave;
  if (grazes) {
    precise float middle = 0.5 * (enter + leave) / params.step;
    uint k = min(uint(middle), params.sampleCount - 1u);
    rayMiddle = middle - float(k);
    rayScene = contains(params.sceneLo, params.sceneHi, samplePosition(k)) ? uvec2(k, k + 1u) : uvec2(0u);
  }
  float first = (float(rayScene.x) + 0.5) * params.step;
  float last = (float(rayScene.y) - 0.5) * params.step;
  rayEnter = params.first + (grazes ? enter : clamp(enter, first - params.step, first));
  rayLeave = params.first + (grazes ? leave : clamp(leave, last, last + params.step));
  rayLeave = max(rayLeave, rayEnter + 0.001 * params.step);
  // Beyond this reach, no block has values, and the picture would depend on the owner of the sample.
  vec3 size = abs(rayDirection);
  float reach = max(params.reach / max(max(size.x, size.y), size.z), 0.5);
  rayBegin = max((rayEnter - params.first) / params.step, middleOf(rayScene.x) - reach);
  rayEnd = min((rayLeave - params.first) / params.step, middleOf(rayScene.y) - 1.0 + reach);
}

// Whether a place has the value of the nearest texel; else values are interpolated.
layout(constant_id = 11) const bool takesNearest = false;

// The size of a page, in texels.
vec3 pageSize(Brick brick) { return brick.cellScale * float(cellSide); }

#define READ_PAGE(i) \
  if (pageCount == 1u ? i == 0u : pageCount > i && page == i) \
    value = takesNearest ? texelFetch(pages[i], ivec3(coordinate * vec3(textureSize(pages[i], 0))), 0).r \
                         : textureLod(pages[i], coordinate, 0.0).r;

// Pages beyond pageCount cost nothing: comparing with a specialisation constant removes them.
float texel(uint page, vec3 coordinate) {
  float value = 0.0;
  READ_PAGE(0u)
  READ_PAGE(1u)
  READ_PAGE(2u)
  READ_PAGE(3u)
  READ_PAGE(4u)
  READ_PAGE(5u)
  READ_PAGE(6u)
  READ_PAGE(7u)
  return value;
}

// Texture coordinate of a place; places outside the brick's values are clamped to them.
vec3 coordinateOf(Brick brick, float place) {
  return clamp(positionAt(place) * brick.texelScale + brick.texelOffset, brick.texelLo, brick.texelHi);
}

// Position in the transfer table. Infinite values, and those that become infinite here, lie far outside the
// table; NaN stays NaN.
float tablePosition(Brick brick, float place) {
  const float farPosition = 1.0e30;
  float position = (texel(brick.page, coordinateOf(brick, place)) - brick.tableOrigin) * brick.tableScale;
  return mix(position, sign(position) * farPosition, mayBeInfinite && abs(position) > farPosition);
}

vec3 placeAmongCells(Brick brick, uint k) {
  return max(coordinateOf(brick, middleOf(k)) * brick.cellScale + brick.cellOffset, vec3(0.0));
}

#include "colors.glsl"
#include "shading.glsl"
#include "blending.glsl"

uvec3 cellAround(Brick brick, vec3 place) { return min(uvec3(place), brick.cellDims - 1u); }

bool showsAnything(Brick brick, uvec3 cell) {
  uint index = brick.firstCell + (cell.z * brick.cellDims.y + cell.y) * brick.cellDims.x + cell.x;
  if (blendMode != blendComposite) return adds(brick, params.ranges.at[index]);
  return params.cells.at[index] != 0u;
}

// The macrocell of sample k: whether it has anything visible, and the first sample after it.
struct CellStretch {
  bool visible;
  uint end;
};

CellStretch cellAt(Brick brick, uint k, vec3 cellsPerSample) {
  vec3 place = placeAmongCells(brick, k);
  uvec3 cell = cellAround(brick, place);
  vec3 corner = vec3(cell) + vec3(greaterThan(cellsPerSample, vec3(0.0)));
  vec3 samples = mix(abs((corner - place) / cellsPerSample), vec3(1.0e6), equal(cellsPerSample, vec3(0.0)));
  // Rounding may assign a sample to the cell before; cells include one texel more than their own.
  float ahead = min(min(samples.x, samples.y), min(samples.z, 1.0e6));
  return CellStretch(showsAnything(brick, cell), k + max(1u, uint(ahead + 0.95)));
}

float frontOf(uint k) { return k == rayScene.x ? rayEnter : params.first + float(k) * params.step; }
float backOf(uint k) {
  return k + 1u == rayScene.y ? rayLeave : params.first + float(k + 1u) * params.step;
}

// The places where sample k begins and ends: samples at the scene's faces are shorter or longer than others.
// If samples are not slabs, both are its middle.
float beginOf(uint k) {
  float place = mix(mix(float(k), rayBegin, k == rayScene.x), rayEnd, k == rayScene.y);
  return mix(middleOf(k), place, params.slabs != 0u);
}
float endOf(uint k) { return mix(middleOf(k), beginOf(k + 1u), params.slabs != 0u); }

#include "nearest.glsl"

// Uses a ray's intervals one by one; within a brick they leave no gaps.
void useSample(float front, float back, Sample it);

// Number of texels, and then of slabs, requested at a time: a GPU waits as long for one as for all. It must
// be 1 if samplesAtOnce is not.
layout(constant_id = 3) const uint samplesAhead = 1;

// Number of samples used as one: more than 1 while pre-segments are counted (CastParams::countedSamples).
uint samplesAtOnce;

// The interval of samples `first` to `last`.
vec2 spanOf(uint first, uint last) {
  return vec2(frontOf(first), backOf(min(last + samplesAtOnce, rayScene.y) - 1u));
}

// The first sample to use, from k on.
uint usedFrom(uint k) { return (k + samplesAtOnce - 1u) / samplesAtOnce * samplesAtOnce; }

// Samples [begin, end) of a projection.
void projectSamples(Brick brick, uint begin, uint end) {
  if (begin < end) project(tablePosition(brick, beginOf(begin)), beginOf(begin));
  for (uint batch = begin; batch < end; batch += samplesAhead) {
    float positions[samplesAhead];
    [[unroll]] for (uint i = 0u; i < samplesAhead; ++i)
      positions[i] = tablePosition(brick, endOf(min(batch + i, end - 1u)));
    [[unroll]] for (uint i = 0u; i < samplesAhead; ++i)
      project(positions[i], endOf(min(batch + i, end - 1u)));
  }
}

// Uses samples [emptyBegin, begin) as one transparent sample, if there are any; the result is the same. Then
// uses the multiples of samplesAtOnce in [begin, end). Returns false once the ray is opaque enough.
bool castSamples(Brick brick, uint emptyBegin, uint begin, uint end) {
  if (projects) {
    projectSamples(brick, begin, end);
    return true;
  }
  uint emptyFirst = usedFrom(emptyBegin);
  uint first = usedFrom(begin);
  bool empty = emptyFirst < first;
  // A sample begins where the last one ends.
  const bool readsEnds = !takesNearest || showsIsosurfaces;
  bool endsMeet = params.slabs != 0u && samplesAtOnce == 1u;
  float ends[samplesAhead + 1u];  // positions in the transfer table
  vec4 between[samplesAhead];
  bool begun = false;
  for (uint batch = empty ? first - samplesAtOnce : first; batch < end;
       batch += samplesAhead * samplesAtOnce) {
    if (readsEnds) {
      if (!begun || !endsMeet) ends[0] = tablePosition(brick, beginOf(batch));
      [[unroll]] for (uint i = 0u; i < samplesAhead; ++i)
        ends[i + 1u] = tablePosition(brick, endOf(batch + i));
    }
    begun = true;
    if (readsEnds && !showsIsosurfaces) {
      [[unroll]] for (uint i = 0u; i < samplesAhead; ++i) {
        between[i] = slabTexel(mix(ends[i + 1u], ends[i], params.slabs != 0u), ends[i + 1u]);
      }
    }
    [[unroll]] for (uint i = 0u; i < samplesAhead; ++i) {
      uint k = batch + i * samplesAtOnce;
      if (samplesAhead == 1u || k < end) {
        bool here = i == 0u && empty;
        vec2 span = spanOf(here ? emptyFirst : k, k);
        Sample it = transparentSample;
        if (showsIsosurfaces) {
          if (!here) it = crossed(brick, k, ends[i], ends[i + 1u]);
        } else if (takesNearest) {
          if (!here) it = nearestSample(brick, k, span.y - span.x);
        } else {
          vec4 slab = slabOf(between[i], mix(ends[i + 1u], ends[i], params.slabs != 0u), ends[i + 1u]);
          it = lit(brick, middleOf(k), sampleOf(mix(slab, vec4(0.0), bvec4(here)), span.y - span.x));
        }
        useSample(span.x, span.y, it);
        rayOpticalDepth += it.opticalDepth;
        if (rayOpticalDepth >= params.terminationOpticalDepth) return false;
      }
    }
    empty = false;
    ends[0] = ends[samplesAhead];
  }
  return true;
}

#include "raycast_lanes.glsl"

const uint shortGap = 32u;  // samples

// Returns false once the ray is opaque enough.
bool castBrick(uint index) {
  Brick brick = params.bricks.at[index];
  uvec2 range = samplesIn(brick.lo, brick.hi);
  range = uvec2(max(range.x, rayScene.x), min(range.y, rayScene.y));
  if (lanesPerRay > 1u) return castLanes(brick, range.x, range.y);
  vec3 cellsPerSample = rayDirection * params.step * brick.texelScale * brick.cellScale;
  uint k = range.x;
  while (k < range.y) {
    uint emptyBegin = k;
    CellStretch stretch = CellStretch(false, k);
    while (k < range.y) {
      stretch = cellAt(brick, k, cellsPerSample);
      if (stretch.visible) break;
      k = min(stretch.end, range.y);
    }
    // Continues as long as cells are visible. Short gaps do not stop the loop, because rays that stop at
    // different places wait for each other.
    uint end = min(stretch.end, range.y);
    for (uint next = end; next < range.y && next < end + shortGap; next = min(stretch.end, range.y)) {
      stretch = cellAt(brick, next, cellsPerSample);
      if (stretch.visible) end = min(stretch.end, range.y);
    }
    if (!castSamples(brick, emptyBegin, k, end)) return false;
    k = end;
  }
  return true;
}

float component(vec3 v, uint axis) { return axis == 0u ? v.x : axis == 1u ? v.y : v.z; }

void castRay() {
  rayOpticalDepth = 0.0;
  if (params.nodeCount == 0u || rayScene.x == rayScene.y) return;
  // Parts of the ray, in units of depth from the lattice's front. They overlap by the rounding error: a brick
  // itself decides, exactly, which samples it owns, and the order of visits follows from the signs of the
  // direction alone.
  uint stackNode[kdMaxDepth];
  vec2 stackPart[kdMaxDepth];
  int top = 0;
  uint node = 0u;
  vec2 part = vec2(0.0, float(params.sampleCount) * params.step);
  for (;;) {
    KdNode here = params.nodes.at[node];
    if (here.axis == 3u) {
      if (here.count != 0u && !castBrick(here.first)) return;
      if (top == 0) return;
      --top;
      node = stackNode[top];
      part = stackPart[top];
      continue;
    }
    float start = component(rayStart, here.axis);
    float direction = component(rayDirection, here.axis);
    if (direction == 0.0) {
      node = here.first + (start < here.split ? 0u : 1u);
      continue;
    }
    float inverse = 1.0 / direction;
    float crossing = (here.split - start) * inverse;
    float spare = 2.0 * params.step + 1e-6 * abs(crossing) +
                  abs(params.coordinateError * inverse);
    uint near = here.first + (direction > 0.0 ? 0u : 1u);
    uint far = here.first + (direction > 0.0 ? 1u : 0u);
    bool meetsNear = part.x <= crossing + spare;
    bool meetsFar = part.y >= crossing - spare;
    if (meetsNear && meetsFar) {
      stackNode[top] = far;
      stackPart[top] = vec2(max(part.x, crossing - spare), part.y);
      ++top;
      node = near;
      part.y = min(part.y, crossing + spare);
    } else {
      node = meetsNear ? near : far;
    }
  }
}

#endif
