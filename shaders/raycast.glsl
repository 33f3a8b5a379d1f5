// One ray through the kd-tree of bricks, front to back, sample by sample.
//
// Needs: shared/cast.h, push.params, pages, pageCount; void useSample(uint k, vec3 color, float opticalDepth), colour
// straight.

vec3 rayStart;
vec3 rayDirection;
float raySampleUnits;  // world length of a sample / unit distance
float rayOpticalDepth;  // so far

void setUpRay(uint x, uint y) {
  float u = float(x) + 0.5 - 0.5 * float(push.params.value.width);
  float v = float(y) + 0.5 - 0.5 * float(push.params.value.height);
  precise vec3 start = push.params.value.startBase + u * push.params.value.startRight + v * push.params.value.startUp;
  precise vec3 direction =
      push.params.value.directionBase + u * push.params.value.directionRight + v * push.params.value.directionUp;
  rayStart = start;
  rayDirection = direction;
  raySampleUnits = length(direction) * push.params.value.perUnitDistance;
}

// `precise`: every rank and every pass must find the same position for sample k, since ownership depends on it.
vec3 samplePosition(uint k) {
  precise float depth = (float(k) + 0.5) * push.params.value.step;
  precise vec3 position = rayStart + depth * rayDirection;
  return position;
}

bool contains(vec3 lo, vec3 hi, vec3 p) { return all(greaterThanEqual(p, lo)) && all(lessThan(p, hi)); }

// Samples [first, last) of the ray that the box owns: one range, because each coordinate is monotone along the ray.
uvec2 samplesIn(vec3 lo, vec3 hi) {
  // Where the ray is in the box, in units of samples, with room for rounding; then exactly, sample by sample.
  float enter = 0.0;
  float leave = float(push.params.value.sampleCount);
  for (int axis = 0; axis < 3; ++axis) {
    if (rayDirection[axis] == 0.0) continue;
    float perSample = 1.0 / (rayDirection[axis] * push.params.value.step);
    float a = (lo[axis] - rayStart[axis]) * perSample;
    float b = (hi[axis] - rayStart[axis]) * perSample;
    float spare = 2.0 + 1e-6 * max(abs(a), abs(b)) + abs(push.params.value.coordinateError * perSample);
    enter = max(enter, min(a, b) - spare);
    leave = min(leave, max(a, b) + spare);
  }
  if (!(enter < leave)) return uvec2(0u);
  uint first = uint(enter);
  uint last = min(push.params.value.sampleCount, uint(ceil(leave)));
  while (first < last && !contains(lo, hi, samplePosition(first))) ++first;
  while (last > first && !contains(lo, hi, samplePosition(last - 1u))) --last;
  return uvec2(first, last);
}

// Pages beyond pageCount cost nothing: the comparison with a specialisation constant removes them.
float texel(uint page, vec3 coordinate) {
  float value = 0.0;
  if (pageCount == 1u || page == 0u) value = textureLod(pages[0], coordinate, 0.0).r;
  if (pageCount > 1u && page == 1u) value = textureLod(pages[1], coordinate, 0.0).r;
  if (pageCount > 2u && page == 2u) value = textureLod(pages[2], coordinate, 0.0).r;
  if (pageCount > 3u && page == 3u) value = textureLod(pages[3], coordinate, 0.0).r;
  if (pageCount > 4u && page == 4u) value = textureLod(pages[4], coordinate, 0.0).r;
  if (pageCount > 5u && page == 5u) value = textureLod(pages[5], coordinate, 0.0).r;
  if (pageCount > 6u && page == 6u) value = textureLod(pages[6], coordinate, 0.0).r;
  if (pageCount > 7u && page == 7u) value = textureLod(pages[7], coordinate, 0.0).r;
  return value;
}

// Straight colour and extinction at a table position; NaN and infinities are transparent.
vec4 classify(float position) {
  float last = float(push.params.value.tableSize - 1u);
  if (!(abs(position) <= 3.0e38)) return vec4(0.0);
  position = clamp(position, 0.0, last);
  uint below = min(uint(position), push.params.value.tableSize - 2u);
  TableEntry a = push.params.value.table.at[below];
  TableEntry b = push.params.value.table.at[below + 1u];
  return mix(vec4(a.red, a.green, a.blue, a.extinction), vec4(b.red, b.green, b.blue, b.extinction),
             position - float(below));
}

// Returns false once the ray is opaque enough.
bool castBrick(uint index) {
  Brick brick = push.params.value.bricks.at[index];
  uvec2 range = samplesIn(brick.lo, brick.hi);
  for (uint k = range.x; k < range.y; ++k) {
    vec3 coordinate =
        clamp(samplePosition(k) * brick.texelScale + brick.texelOffset, brick.texelLo, brick.texelHi);
    vec4 entry = classify((texel(brick.page, coordinate) - brick.tableOrigin) * brick.tableScale);
    float opticalDepth = min(entry.a * raySampleUnits, maxOpticalDepth);
    useSample(k, entry.rgb, opticalDepth);
    rayOpticalDepth += opticalDepth;
    if (rayOpticalDepth >= push.params.value.enough) return false;
  }
  return true;
}

const int kdStackSize = 40;  // VolumeStore builds no deeper tree

void castRay() {
  rayOpticalDepth = 0.0;
  if (push.params.value.nodeCount == 0u) return;
  // Parts of the ray, in units of depth from the lattice's front. They overlap by the rounding error: a brick decides by
  // itself, exactly, which samples are its own; the order of visits comes from the signs of the direction alone.
  uint stackNode[kdStackSize];
  vec2 stackPart[kdStackSize];
  int top = 0;
  uint node = 0u;
  vec2 part = vec2(0.0, float(push.params.value.sampleCount) * push.params.value.step);
  for (;;) {
    KdNode here = push.params.value.nodes.at[node];
    if (here.axis == 3u) {
      if (here.count != 0u && !castBrick(here.first)) return;
      if (top == 0) return;
      --top;
      node = stackNode[top];
      part = stackPart[top];
      continue;
    }
    float start = rayStart[here.axis];
    float direction = rayDirection[here.axis];
    if (direction == 0.0) {
      node = here.first + (start < here.split ? 0u : 1u);
      continue;
    }
    float inverse = 1.0 / direction;
    float crossing = (here.split - start) * inverse;
    float spare = 2.0 * push.params.value.step + 1e-6 * abs(crossing) +
                  abs(push.params.value.coordinateError * inverse);
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
